"""Simulates a plan: builds the closed loop, runs it, checks and records every accepted step."""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from math import inf
from typing import Any

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, EventStatus

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan, plan_digest
from coop_drake.diagram import Loop, Replacements, World, build_closed_loop
from coop_drake.diagram.robot_controller import arrival_goal
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.laws import readiness
from coop_drake.laws.axis_table import axis_table
from coop_drake.laws.ppc import governed_gains
from coop_drake.plant import TeamPlant, read_component_tree
from coop_drake.plant.facts import scenario_digest
from coop_drake.progress import Progress
from coop_drake.scenario import Scenario
from coop_drake.simulation.clearance import TeamClearance
from coop_drake.simulation.telemetry import Invariants, Margins, Sample, Telemetry
from coop_drake.systems.kernels import cell_margin
from coop_drake.systems.messages import ASKED, BRAKED, SILENT, TOLD
from coop_drake.tree.arrays import FloatArray


@contextmanager
def joint_limits_kept_by_funnels() -> Iterator[None]:
    """Suppress Drake's warning that it does not simulate joint limits in continuous time, and no other.

    Slices lie within the joint limits and funnels within slices; the invariants check this at every step.
    """
    logger = logging.getLogger("drake")
    logger.addFilter(_matters)
    try:
        yield
    finally:
        logger.removeFilter(_matters)


def _matters(record: logging.LogRecord) -> bool:
    return "does not handle joint limits for continuous models" not in record.getMessage()


def simulate(
    scenario: Scenario,
    plan: Plan,
    maps: Sequence[HarmonicMap],
    *,
    replacements: Replacements | None = None,
    progress: Progress | None = None,
    observer: Callable[[Sample], None] | None = None,
) -> SimulationLog:
    """Run the closed loop from the plan's start until the object rests at the goal, or the run fails.

    Every accepted step is checked against the invariants and logged. A broken invariant ends the run, as do
    a stall and the scenario's ``max_time``; the log says why. :func:`coop_drake.compiled_loop.run` makes a
    run of a sampled team a hundred times quicker, and leaves its margins alone.

    Args:
        scenario: The scenario.
        plan: A plan for it.
        maps: The harmonic map of every transition.
        replacements: Blocks of a user's own in every robot's controller, by the name of the block that they
            replace, such as ``axis_ppc``.
        progress: Called with the stage and the fraction done, if given.
        observer: Called with every accepted step, for example a live view; it changes nothing about the run.

    Raises:
        PlanError: The plan belongs to another team, or the number of maps is not the number of cells.
        ScenarioError: The models do not make a team.
    """
    loop = build_closed_loop(scenario, plan, maps, replacements=replacements)
    try:
        return run_loop(loop, scenario, progress=progress, observer=observer)
    finally:
        loop.release()
        del loop
        # Diagrams and their systems refer to each other in cycles, and Python does not see their size: else
        # the plants of many runs would fill the memory. They are new objects, so a collection of the two
        # younger generations frees them and takes less time than a full one.
        gc.collect(1)


def run_loop(
    loop: Loop,
    scenario: Scenario,
    *,
    progress: Progress | None = None,
    observer: Callable[[Sample], None] | None = None,
) -> SimulationLog:
    """Run a closed loop, or a world whose robots run elsewhere, as :func:`simulate` does."""
    plan = loop.plan
    clearance = TeamClearance(scenario.workspace.polygon, read_component_tree(loop.team.as_tree))
    root = loop.create_context()
    watch = Watch(
        loop,
        Invariants(clearance, plan, exact=scenario.ideal),
        arrival_goal(scenario, plan, slice(None)),
        root,
        progress,
        observer,
    )
    simulator = Simulator(loop.diagram, root)
    configure_simulator(simulator, scenario)
    simulator.set_monitor(watch)
    with joint_limits_kept_by_funnels():
        simulator.Initialize()
        if not watch.ended:
            _advance(simulator, watch, scenario.simulator.max_time)
    return watch.recorder.to_log(
        reached=watch.reached,
        violation=watch.violation,
        joint_names=plan.joint_names,
        robot_names=tuple(robot.name for robot in loop.team.robots),
        plan_digest=plan_digest(plan),
        scenario_digest=scenario_digest(scenario),
    )


def configure_simulator(simulator: Simulator, scenario: Scenario) -> None:
    """Set a simulator's integrator as a scenario asks for.

    Args:
        simulator: Of a loop that was built for the scenario.
        scenario: The scenario.
    """
    if not scenario.plant.ideal:
        # Between two steps of the plant only governors move, at a rate that is constant but for themselves.
        step = scenario.plant.time_step
        config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=step)
        ApplySimulatorConfig(config, simulator)
        return
    settings = scenario.simulator
    scheme = settings.integration_scheme
    if scheme == "runge_kutta5" and scenario.deployment.period is not None:
        # Efforts that are held do not react within a step: where they are absurdly large, rates grow with
        # every stage of a trial step, and an infinite state after seven stages would end the process.
        scheme = "bogacki_shampine3"
    # Schemes without an error estimate take the longest step always; Drake ignores the accuracy for them.
    config = SimulatorConfig(
        integration_scheme=scheme,
        max_step_size=settings.max_step_size,
        accuracy=settings.accuracy,
        use_error_control=True,
    )
    ApplySimulatorConfig(config, simulator)


def _advance(simulator: Simulator, watch: Watch, max_time: float) -> None:
    try:
        # Trial steps of a run that fails may overflow; the watch reports the failure.
        with np.errstate(over="ignore", invalid="ignore"):
            simulator.AdvanceTo(max_time)
    except RuntimeError as error:
        # Drake's own failures, such as a step that shrinks to nothing; errors of Python keep their type.
        watch.fail(f"the integrator failed ({error})")
        return
    if not watch.ended:
        watch.give_up(f"no arrival within max_time = {max_time:g} s")


# When a run ends, and why.

PATIENCE_FACTOR = 10.0
"""A transition may take this many times its estimated time [-]: estimates are within a factor of two."""

PATIENCE_ALLOWANCE = 20.0
"""And this much longer [s], for transitions that are estimated at a fraction of a second."""


def patience(plan: Plan, cell: int) -> float:
    """Return the longest time that a transition is waited for [s]."""
    return PATIENCE_FACTOR * plan.transitions[cell].estimated_time + PATIENCE_ALLOWANCE


def blocking_margin(plan: Plan, sample: Sample, goal: readiness.ArrivalGoal) -> str:
    """Return the condition that is furthest from being met in the current cell, as a phrase with its margin.

    Args:
        plan: The plan.
        sample: The present instant.
        goal: The goal of the whole team; the tolerances count, no errors.
    """
    if sample.held:
        return f"the hold ends: {_causes_of(sample)}"
    last = sample.cell == len(plan.cells) - 1
    if sample.phases.size and not last:
        return f"the motion goes on from the phase {sample.phases[:, 0].min():.6g} s"
    margins = _arrival(plan, sample, goal) if last else _readiness(plan, sample)
    if last and min(margins.values()) >= 0.0 > min(sample.ready_margins):
        k = int(np.argmin(sample.ready_margins))
        return f"robot {k} measures that the goal is reached (margin {sample.ready_margins[k]:.3g})"
    if min(margins.values()) >= 0.0:
        return "the cell planner receives the robots' reports; all robots are ready"
    name = min(margins, key=lambda key: margins[key])
    return f"{name} (margin {margins[name]:.3g})"


def _causes_of(sample: Sample) -> str:
    """Return why the team is held, as a phrase."""
    words = {
        TOLD: "it is told so",
        ASKED: "asks for it",
        SILENT: "is not heard",
        BRAKED: "lets the drives brake",
    }
    names = ["", *(f"robot {k} " for k in range(len(sample.causes) - 1))]
    found = [name + words[cause] for name, cause in zip(names, sample.causes, strict=True) if cause]
    return ", ".join(found)


def narrowest_funnel(plan: Plan, sample: Sample) -> str:
    """Return the axis that is nearest to a bound of its funnel, as a phrase with its margin and its rate."""
    axes = sample.z[2:]
    margins = np.minimum(axes - sample.funnel_lower, sample.funnel_upper - axes)
    i = int(np.argmin(margins))
    return f"{_axes(plan)[i]} (margin {margins[i]:.3g} rad or m, rate {sample.rates[2 + i]:.3g} per second)"


def _axes(plan: Plan) -> tuple[str, ...]:
    return ("the object's angle", *plan.joint_names)


def _readiness(plan: Plan, sample: Sample) -> dict[str, float]:
    following = sample.cell + 1
    gains = plan.transitions[following].gains
    stiffness = governed_gains(plan.governor_row(following), 0.0)[0]
    margin, _ = cell_margin(
        BoundaryDistance(plan.governed(following)).edges,
        stiffness,
        np.concatenate([sample.z[:3], sample.rates[:3]]),
        sample.governor_position,
    )
    margins = {
        "the object's position is safe in the next cell (Delta E)": readiness.clearance_margin(
            margin, stiffness, plan.transitions[sample.cell].inradius
        )
    }
    own = axis_table(plan.funnel(sample.cell), plan.transitions[sample.cell].gains)
    table = axis_table(plan.funnel(following), gains)
    for i, name in enumerate(_axes(plan)):
        inside, slow = readiness.axis_ready(own[i], table[i], sample.z[2 + i], sample.rates[2 + i])
        margins[f"{name} reaches its goal interval"] = inside
        margins[f"the energy of {name} falls below the next funnel's bound"] = slow
    return margins


def off_goal(goal: readiness.ArrivalGoal, z: FloatArray) -> float:
    """Return how far object and joints are from the goal, over what is tolerated, whatever was measured.

    Args:
        goal: That of the whole team.
        z: Where they are, shape (3 + n,) [m, rad].
    """
    away = np.abs(z - goal.place)
    return float(max(np.hypot(*away[:2]) / goal.tolerances[0], *(away[2:] / goal.tolerances[1:])))


def _arrival(plan: Plan, sample: Sample, goal: readiness.ArrivalGoal) -> dict[str, float]:
    tolerance, axes = float(goal.tolerances[0]), zip(_axes(plan), sample.z[2:], goal.place[2:], strict=True)
    margins = {
        f"{name} reaches its goal": 1.0 - abs(position - place) / ((1.0 - readiness.EROSION) * room)
        for (name, position, place), room in zip(axes, goal.tolerances[1:], strict=True)
        if room < inf
    }
    distance = float(np.hypot(*(sample.z[:2] - goal.place[:2])))
    margins["the object reaches its goal position"] = readiness.position_arrival(distance, 0.0, tolerance)
    speed = float(np.hypot(*sample.rates[:2]))
    margins["the object and the joints come to rest"] = min(
        readiness.position_arrival(0.0, speed, tolerance),
        1.0 - float(np.abs(sample.rates[2:]).max()) / readiness.RATE_TOLERANCE,
    )
    return margins


# Collects samples and margins into a log.


class Recorder:
    """Collects the accepted steps of a run."""

    def __init__(self) -> None:
        self._rows: list[tuple[Sample, Margins]] = []

    def add(self, sample: Sample, margins: Margins) -> None:
        """Add one step."""
        self._rows.append((sample, margins))

    def to_log(self, **ends: Any) -> SimulationLog:
        """Return the log of all steps.

        Args:
            ends: The log's fields from ``reached`` on, which are the same for all steps.
        """
        z, rates = self._column("z"), self._column("rates")
        known = {*Margins._fields, *(field.name for field in fields(Sample))} - set(ends)
        names = [field.name for field in fields(SimulationLog) if field.name in known]
        arrays: dict[str, Any] = {name: self._column(name) for name in names}
        return SimulationLog(
            times=self._column("time"),
            cell_index=self._column("cell").astype(np.int64),
            transition_start=self._column("entry"),
            object_pose=z[:, :3],
            object_twist=rates[:, :3],
            joints=z[:, 3:],
            joint_rates=rates[:, 3:],
            **arrays,
            **ends,
        )

    def _column(self, name: str) -> FloatArray:
        """Return a field of the margins of all steps, or else of their samples."""
        rows = [margins if hasattr(margins, name) else sample for sample, margins in self._rows]
        return np.array([getattr(row, name) for row in rows], dtype=float)


# Checks and records every accepted step of a run, and decides when the run ends.


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
        goal: readiness.ArrivalGoal,
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
        self._moved = 0.0

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
            self._see_stop(margins, self._loop.link.trouble)
        elif margins.violation:
            self.violation = margins.violation
        elif (asking := self._beyond_holding(sample)) is not None:
            self.violation = f"at t = {sample.time:.6g} s in cell {sample.cell}: {asking}"
        elif sample.arrived:
            self._see_arrival(sample)
        elif self._stalls(sample):
            self.give_up("stalled")
        if not self.ended:
            return None
        return EventStatus.ReachedTermination(self._loop.diagram, self.violation or "arrived")

    def _stalls(self, sample: Sample) -> bool:
        """Whether the team will hardly go on: it is too long in its cell, or rests on its motion untold."""
        if not sample.phases.size:
            waited = sample.time - sample.entry - sample.clock_lag
            return waited > patience(self._loop.plan, sample.cell)
        if sample.phases[:, 1].any() or sample.causes[0] == TOLD:
            self._moved = sample.time
        return sample.time - self._moved > PATIENCE_ALLOWANCE

    def _beyond_holding(self, sample: Sample) -> str | None:
        """Return why a robot's monitor ends the run, None where it does not.

        The drives brake where a departure grows on. A team that is held for long by its own monitors will
        not go on.
        """
        asking = [k for k, cause in enumerate(sample.causes[1:]) if cause == ASKED]
        braking = [k for k, cause in enumerate(sample.causes[1:]) if cause == BRAKED]
        since = sample.time if self._asked_since is None else self._asked_since
        self._asked_since = since if asking else None
        team, plan = self._loop.team, self._loop.plan
        if braking:
            return f"{_names(team, braking)} lets the drives brake{_departing(team, plan, sample)}"
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

    def _see_stop(self, margins: Margins, trouble: str) -> None:
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
    what = readiness.departing_name(int(check), plan.joint_names[robot.q_slice])
    return f": {what} departs {share:.3g} times as far as its level allows, as {robot.name} measures it"
