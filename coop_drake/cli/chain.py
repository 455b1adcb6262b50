"""The chain, link by link: scenario, plan, maps, simulation, pictures; each notes its facts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import remainder, tau
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.cli.measures import (
    map_measures,
    peak_memory_mb,
    plan_measures,
    planning_measures,
    simulation_measures,
)
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.errors import PlanError, ScenarioError
from coop_drake.files import write_atomically
from coop_drake.planning import (
    Found,
    Infeasible,
    Plan,
    PlanningProblem,
    PlanningResult,
    load_plan,
    reschedule,
    save_plan,
)
from coop_drake.planning.planner import plan
from coop_drake.planning.separation_file import save_separation
from coop_drake.planning.warm_up import main as load_kernels
from coop_drake.plant import build_team_plant, planning_problem
from coop_drake.scenario import Scenario, load_scenario
from coop_drake.simulation import SimulationLog, build_maps, simulate
from coop_drake.viz import table_1, write_figures, write_recording

__all__ = ["Task", "load_task", "plan_task", "read_plan", "simulate_task", "warm_up", "write_pictures"]

_SAME_GOAL = 1e-9  # Rounding of whole turns of the goal's angle [m, rad].
_WARM_UP_SECONDS = 0.05  # Simulated time that calls every kernel [s].


@dataclass(frozen=True)
class Task:
    """A scenario that was read and found sound.

    Attributes:
        scenario: As in the file.
        problem: What the planner is asked.
        gains: Name of the gain set in use.
    """

    scenario: Scenario
    problem: PlanningProblem
    gains: str


def load_task(path: Path, gains: str | None) -> Task:
    """Read a scenario and its models.

    Args:
        path: The scenario file.
        gains: Name of the gain set to use, None for the one the file selects.

    Raises:
        ScenarioError: The file, a model or the name of the gain set is wrong.
    """
    scenario = load_scenario(path)
    name = scenario.selected_gains if gains is None else gains
    if name not in scenario.gain_sets:
        allowed = "one of " + ", ".join(sorted(scenario.gain_sets))
        raise ScenarioError(str(path), "--gains", name, allowed)
    team = build_team_plant(scenario, DiagramBuilder())
    return Task(scenario, planning_problem(scenario, team), name)


def plan_task(task: Task, folder: ResultFolder, reporter: Reporter) -> PlanningResult:
    """Plan, note what it took, and write the plan, or the proof that there is none.

    Compiled parts are loaded first, on a clock of their own: what planning took does not depend on the cache.
    """
    with reporter.stage("loading"), _stopwatch(reporter, "loading", cpu=True):
        load_kernels()
    with reporter.stage("planning") as progress, _stopwatch(reporter, "planning", cpu=True):
        gain_set = task.scenario.gain_sets[task.gains]
        result = plan(task.problem, gain_set, gain_set_name=task.gains, progress=progress)
    reporter.facts.update(planning_measures(result), peak_memory_mb=peak_memory_mb())
    folder.make()
    folder.forget_plan()
    if isinstance(result, Found):
        save_plan(result.plan, folder.plan)
        write_atomically(folder.table, table_1(result.plan).encode())
    elif isinstance(result, Infeasible) and result.separation is not None:
        save_separation(result.separation, task.problem, folder.certificate)
    return result


def read_plan(task: Task, path: Path, reporter: Reporter, *, gains_given: bool) -> Plan:
    """Read a plan that was made for this scenario.

    Args:
        task: The scenario.
        path: The plan file.
        reporter: Takes note of the plan's size.
        gains_given: Whether the gain set was asked for; else the plan's own gains stay.

    Raises:
        PlanError: The file is no plan, or belongs to another scenario.
    """
    found = load_plan(path)
    names = tuple(joint.name for joint in task.problem.tree.joints)
    if found.joint_names != names:
        raise PlanError(
            f"{path}: the plan moves {_listed(found.joint_names)}; the scenario has {_listed(names)}"
        )
    if not np.array_equal(found.start, task.problem.start):
        raise PlanError(
            f"{path}: the plan starts at {found.start}; the scenario starts at {task.problem.start}"
        )
    _check_goal(task.problem, found, path)
    if gains_given and task.gains != found.gain_set:
        found = reschedule(found, task.scenario.gain_sets[task.gains], task.gains)
    reporter.facts.update(
        answer="found", slices=0, first_plan_cpu_seconds=0.0, planning_cpu_seconds=0.0, **plan_measures(found)
    )
    return found


def _check_goal(problem: PlanningProblem, found: Plan, path: Path) -> None:
    away = found.goal_pose - problem.goal_pose
    away[2] = remainder(away[2], tau)
    if found.goal_joints != problem.goal_joints or np.abs(away).max() > _SAME_GOAL:
        raise PlanError(
            f"{path}: the plan ends at {found.goal_pose} with joints {found.goal_joints}; "
            f"the scenario's goal is {problem.goal_pose} with joints {problem.goal_joints}"
        )


def simulate_task(task: Task, found: Plan, folder: ResultFolder, reporter: Reporter) -> SimulationLog:
    """Map every cell, run the closed loop, note how it went and write the log."""
    with reporter.stage("mapping") as progress, _stopwatch(reporter, "mapping"):
        maps = build_maps(found, progress=progress)
    reporter.facts.update(map_measures(maps))
    with reporter.stage("simulating") as progress, _stopwatch(reporter, "simulation"):
        log = simulate(task.scenario, found, maps, progress=progress)
    reporter.facts.update(simulation_measures(found, log), peak_memory_mb=peak_memory_mb())
    folder.make()
    folder.forget_simulation()
    log.save(folder.log)
    return log


def write_pictures(
    task: Task, found: Plan, log: SimulationLog, folder: ResultFolder, reporter: Reporter
) -> None:
    """Draw the figures and write the recording."""
    with reporter.stage("drawing"):
        write_figures(task.problem.workspace, task.problem.tree, found, log, folder.path)
    with reporter.stage("recording") as progress, _stopwatch(reporter, "recording"):
        write_recording(task.scenario, found, log, folder.recording, progress=progress)


def warm_up(task: Task, reporter: Reporter) -> None:
    """Go through the chain once without results: compiles every kernel, for later processes too."""
    with reporter.stage("compiling") as progress:
        result = plan(task.problem, task.scenario.gain_sets[task.gains], gain_set_name=task.gains)
        if isinstance(result, Found):
            maps = build_maps(result.plan, progress=progress)
            short = replace(task.scenario.simulator, max_time=_WARM_UP_SECONDS)
            simulate(replace(task.scenario, simulator=short), result.plan, maps)


@contextmanager
def _stopwatch(reporter: Reporter, name: str, *, cpu: bool = False) -> Iterator[None]:
    """Note how long a stage took, even if it fails [s]."""
    wall, processor = perf_counter(), process_time()
    try:
        yield
    finally:
        reporter.facts[f"{name}_wall_seconds"] = round(perf_counter() - wall, 4)
        if cpu:
            reporter.facts[f"{name}_cpu_seconds"] = round(process_time() - processor, 4)


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "no joint"
