"""Simulates a plan: builds the closed loop, runs it and returns the log."""

from __future__ import annotations

import gc
import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.plan_file import plan_digest
from coop_drake.diagram import Loop, Replacements, build_closed_loop
from coop_drake.diagram.knowledge import arrival_goal
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.plant import read_component_tree
from coop_drake.plant.scenario_digest import scenario_digest
from coop_drake.progress import Progress
from coop_drake.scenario import Scenario
from coop_drake.simulation.clearance import TeamClearance
from coop_drake.simulation.invariants import Invariants
from coop_drake.simulation.telemetry import Sample
from coop_drake.simulation.watch import Watch


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


# Simulates a plan: builds the closed loop, runs it and returns the log.


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
