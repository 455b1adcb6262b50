"""Checks and records every accepted step of a run, and decides when the run ends."""

from __future__ import annotations

from collections.abc import Callable

from pydrake.systems.framework import Context, EventStatus

from coop_drake.answers.plan import Plan
from coop_drake.diagram import World
from coop_drake.simulation.invariants import Invariants, Margins
from coop_drake.simulation.logged_ports import LoggedLoop
from coop_drake.simulation.recorder import Recorder
from coop_drake.simulation.stall import at_goal, blocking_margin, narrowest_funnel, patience
from coop_drake.simulation.telemetry import Sample, Telemetry


class Watch:
    """The simulator's monitor: called on every accepted step, it ends the run on arrival, violation or stall.

    Args:
        loop: The closed loop that runs.
        invariants: What must hold.
        position_tolerance: How close to the goal counts as arrived [m].
        root: Context of the whole diagram in the simulator.
        progress: Called with the stage and the fraction done, if given.
        observer: Called with every accepted step, if given.
    """

    def __init__(
        self,
        loop: LoggedLoop,
        invariants: Invariants,
        position_tolerance: float,
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
        self._tolerance = position_tolerance
        self._last: Sample | None = None
        self._returns = False

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
        elif margins.violation and not (self._returns and self._still_returns(margins)):
            self.violation = margins.violation
        elif sample.arrived and at_goal(self._loop.plan, sample, self._tolerance):
            self.reached = True
        elif sample.time - sample.entry - sample.clock_lag > patience(self._loop.plan, sample.cell):
            self.give_up("stalled")
        if not self.ended:
            return None
        return EventStatus.ReachedTermination(self._loop.diagram, self.violation or "arrived")

    def _see_stop(self, sample: Sample, margins: Margins, trouble: str) -> None:
        """Watch a team whose drives brake for contacts, until it begins its cell anew or cannot go on."""
        self._returns = True
        if not min(margins.workspace_clearance, margins.body_clearance) > 0.0:
            self.violation = f"{trouble or 'while the drives braked'}; {margins.violation}"
        elif trouble:
            self.violation = f"{trouble}, without contact"

    def _still_returns(self, margins: Margins) -> bool:
        """Whether a team that has begun its cell anew has touched nothing and is not in its slices again."""
        free = min(margins.workspace_clearance, margins.body_clearance, margins.cell_clearance) > 0.0
        self._returns = free and not margins.slice_margin > 0.0 and margins.funnel_margin > 0.0
        return self._returns

    def give_up(self, why: str) -> None:
        """End the run without arrival; the message names the condition that was not met.

        Args:
            why: What happened, for example ``stalled``.
        """
        self._end(why, lambda plan, last: f"it waits until {blocking_margin(plan, last, self._tolerance)}")

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
