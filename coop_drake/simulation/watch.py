"""Checks and records every accepted step of a run, and decides when the run ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydrake.systems.framework import Context, EventStatus

from coop_drake.answers.plan import Plan
from coop_drake.diagram import Loop, World
from coop_drake.laws.arrival import ArrivalGoal
from coop_drake.laws.departure import departing_name
from coop_drake.plant import TeamPlant
from coop_drake.simulation.invariants import Invariants, Margins
from coop_drake.simulation.recorder import Recorder
from coop_drake.simulation.stall import (
    PATIENCE_ALLOWANCE,
    blocking_margin,
    narrowest_funnel,
    off_goal,
    patience,
)
from coop_drake.simulation.telemetry import Sample, Telemetry
from coop_drake.systems.hold_supervisor import ASKED, BRAKED


class Watch:
    """The simulator's monitor: called on every accepted step, it ends the run on arrival, violation or stall.

    Args:
        loop: The closed loop that runs.
        invariants: What must hold.
        goal: The goal of the whole team; the tolerances count, no errors.
        root: Context of the whole diagram in the simulator.
        progress: Called with the stage and the fraction done, if given.
        observer: Called with every accepted step, if given.
    """

    def __init__(
        self,
        loop: Loop,
        invariants: Invariants,
        goal: ArrivalGoal,
        root: Context,
        progress: Callable[[str, float], None] | None,
        observer: Callable[[Sample], None] | None = None,
    ) -> None:
        self.recorder = Recorder()
        self.reached = False
        self.violation = ""
        self._loop, self._invariants = loop, invariants
        self._progress, self._observer = progress, observer
        self._telemetry = Telemetry(loop, root)
        self._goal = goal
        self._last: Sample | None = None
        self._asked_since: float | None = None

    @property
    def ended(self) -> bool:
        """Whether the run has ended."""
        return self.reached or bool(self.violation)

    def __call__(self, _: Context) -> EventStatus | None:
        """Check and record one accepted step."""
        sample = self._telemetry.read()
        margins = self._invariants.check(sample)
        self.recorder.add(sample, margins)
        self._last = sample
        self._report(sample)
        if self._observer is not None:
            self._observer(sample)
        if isinstance(self._loop, World) and (self._loop.link.trouble or self._loop.link.stopped):
            self._see_stop(sample, margins, self._loop.link.trouble)
        elif margins.violation:
            self.violation = margins.violation
        elif (asking := self._beyond_holding(sample)) is not None:
            self.violation = f"at t = {sample.time:.6g} s in cell {sample.cell}: {asking}"
        elif sample.arrived:
            self._see_arrival(sample)
        elif sample.time - sample.entry - sample.clock_lag > patience(self._loop.plan, sample.cell):
            self.give_up("stalled")
        if not self.ended:
            return None
        return EventStatus.ReachedTermination(self._loop.diagram, self.violation or "arrived")

    def _beyond_holding(self, sample: Sample) -> str | None:
        """Return why a robot's monitor ends the run, None where it does not.

        The drives brake where a departure grows on. A loop without a supervisor cannot be held. A team
        that is held for long by its own monitors will not go on.
        """
        if not sample.causes.size:
            asking = np.flatnonzero(sample.alarms[:, 0]).tolist()
        else:
            asking = [k for k, cause in enumerate(sample.causes[1:]) if cause == ASKED]
        braking = [k for k, cause in enumerate(sample.causes[1:]) if cause == BRAKED]
        since = sample.time if self._asked_since is None else self._asked_since
        self._asked_since = since if asking else None
        team, plan = self._loop.team, self._loop.plan
        if braking:
            return f"{_names(team, braking)} lets the drives brake{_departing(team, plan, sample)}"
        if asking and not sample.causes.size:
            return f"{_names(team, asking)} asks for a hold{_departing(team, plan, sample)}"
        if asking and sample.time - since > PATIENCE_ALLOWANCE:
            long = f"has asked for a hold since t = {since:.6g} s"
            return f"{_names(team, asking)} {long}{_departing(team, plan, sample)}"
        return None

    def _see_arrival(self, sample: Sample) -> None:
        """End the run of a team that says that it has arrived: whether that is so, the world's poses tell."""
        away = off_goal(self._goal, sample.z)
        self.reached = away <= 1.0
        if not self.reached:
            x, y, angle = sample.z[:3] - self._goal.place[:3]
            self.violation = (
                f"at t = {sample.time:.6g} s the team says that it has arrived, but is {away:.3g} times the "
                f"tolerance off the goal: the object by {np.hypot(x, y):.3g} m and {abs(angle):.3g} rad"
            )

    def _see_stop(self, sample: Sample, margins: Margins, trouble: str) -> None:
        """Watch a team that does not follow the plan for contacts, until it does so again or cannot go on."""
        if not min(margins.workspace_clearance, margins.body_clearance) > 0.0:
            self.violation = f"{trouble or 'while the drives braked'}; {margins.violation}"
        elif trouble:
            self.violation = f"{trouble}, without contact"

    def give_up(self, why: str) -> None:
        """End the run without arrival; the message names the condition that was not met.

        Args:
            why: What happened, for example ``stalled``.
        """
        self._end(why, lambda plan, last: f"it waits until {blocking_margin(plan, last, self._goal)}")

    def fail(self, why: str) -> None:
        """End a run that cannot be integrated further; the message names the axis nearest to a bound."""
        self._end(why, lambda plan, last: f"next to break was the funnel of {narrowest_funnel(plan, last)}")

    def _end(self, why: str, explanation: Callable[[Plan, Sample], str]) -> None:
        if self._last is None:
            self.violation = why
            return
        sample, plan = self._last, self._loop.plan
        self.violation = (
            f"{why} at t = {sample.time:.6g} s in cell {sample.cell} of {len(plan.cells)}, entered at "
            f"{sample.entry:.6g} s with {plan.transitions[sample.cell].estimated_time:.3g} s estimated; "
            f"{explanation(plan, sample)}"
        )

    def _report(self, sample: Sample) -> None:
        if self._progress is None:
            return
        estimate = self._loop.plan.transitions[sample.cell].estimated_time
        within = 1.0 if sample.arrived else min(0.99, (sample.time - sample.entry) / max(estimate, 1e-9))
        self._progress("simulating", (sample.cell + within) / len(self._loop.plan.cells))


def _names(team: TeamPlant, robots: Sequence[int]) -> str:
    return " and ".join(team.robots[k].name for k in robots)


def _departing(team: TeamPlant, plan: Plan, sample: Sample) -> str:
    """Return what departs the most from its nominal motion, as a clause; nothing where no monitor looks."""
    if not sample.alarms.size:
        return ""
    k = int(np.argmax(sample.alarms[:, 1]))
    robot, (_, share, check) = team.robots[k], sample.alarms[k].tolist()
    what = departing_name(int(check), plan.joint_names[robot.q_slice])
    return f": {what} departs {share:.3g} times as far as its level allows, as {robot.name} measures it"
