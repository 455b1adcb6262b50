"""Teams that pass beside teams that rest: times, stops, dips, shares of limits, with and without noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from time import process_time

import numpy as np

from benchmarks.departures import deployment_of
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Found, Scenario, build_maps, load_scenario, plan
from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.speeds import peak_speeds, steadiness
from coop_drake.compiled_loop import prepare, run
from coop_drake.compiling import COMPILING
from coop_drake.errors import PlanError
from coop_drake.plant import planning_problem
from coop_drake.scenario import with_gains
from coop_drake.scenario.model import RobotLimits
from coop_drake.simulation import simulate
from coop_drake.tree.arrays import FloatArray

QUICKEST = {"base": 12.2, "tight": 13.0, "three": 13.2, "elbow": 12.1, "warehouse": 11.7}
"""The quickest ways through the floors at these limits that an uncertified search found once [s]."""

RUNS = 200
"""Compiled runs of each team under the preset, by seeds from 0 on."""

_LIMITS = {
    "*": RobotLimits(
        1.0, 1.0, (1.0,), (2.0,), base_acceleration=1.0, base_turn_acceleration=2.0, base_jerk=10.0
    ),
    "object": RobotLimits(acceleration=1.5),
}
"""Bases at 1 m/s, 1 rad/s, 1 m/s^2, 2 rad/s^2 and 10 m/s^3, the object at 1.5 m/s^2, joints at 1 and 2."""


def smooth_tasks() -> list[Task]:
    """Each shipped team that has a plan: the ideal one, and that of the preset under its budget."""
    ideal = [Task(f"smooth/ideal/{team}", partial(_ideal, team)) for team in QUICKEST]
    return [*ideal, *(Task(f"smooth/budget/{team}", partial(_under_budget, team)) for team in QUICKEST)]


def _scenario(team: str, **changes: object) -> Scenario:
    scenario = load_scenario(team)
    return replace(scenario, limits=_LIMITS, **changes)  # type: ignore[arg-type]


def _planned(scenario: Scenario) -> tuple[Plan, float]:
    """Return a plan, and the processor time that it took once all was compiled [s]."""
    for _ in range(2):
        begun, compiling = process_time(), COMPILING.cpu_seconds
        result = plan(scenario)
        seconds = process_time() - begun - COMPILING.cpu_seconds + compiling
    if not isinstance(result, Found):
        raise PlanError(f"{scenario.path}: no plan: {result.reason}")
    return result.plan, seconds


def _ideal(team: str, _: Sequence[Row]) -> list[Row]:
    """Return how the ideal team passes, beside the quickest way known, and what planning takes."""
    scenario, name = _scenario(team), f"smooth/ideal/{team}"
    made, seconds = _planned(scenario)
    others, of_others = _planned(with_gains(scenario, "scheduled"))
    estimated = sum(one.estimated_time for one in others.transitions)
    log = simulate(scenario, made, build_maps(made))
    dips, switches = dips_of(log)
    used = max(one.peak / one.limit for one in peak_speeds(log, planning_problem(scenario)) if one.limit)
    forces = np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1])
    pushed = np.hypot(log.accelerations[:, 0], log.accelerations[:, 1])
    return [
        Row(f"{name}/simulated", float(log.times[-1]), "s", "quickest known", QUICKEST[team]),
        Row(f"{name}/with_stops", estimated, "s, estimated"),
        Row(f"{name}/near_stops", steadiness(log)[0], "stops"),
        Row(f"{name}/dips", dips, "switches", "all", switches),
        Row(f"{name}/limit_used", used, "of a limit"),
        Row(f"{name}/object", float(pushed.max()), "m/s^2", "limit", 1.5),
        Row(f"{name}/force", float(forces.max()), "N"),
        Row(f"{name}/planning", seconds, "s", "with stops", of_others),
    ]


def dips_of(log: SimulationLog) -> tuple[int, int]:
    """Return at how many switches the object is slower than 0.7 of the mean of the two seconds around them.

    Returns:
        Their number, and that of all switches.
    """
    speeds: FloatArray = np.hypot(log.object_twist[:, 0], log.object_twist[:, 1])
    grid = np.arange(0.0, log.times[-1], 0.01)
    even, found = np.interp(grid, log.times, speeds), 0
    switches = log.times[np.flatnonzero(np.diff(log.cell_index)) + 1]
    for time in switches:
        around = even[np.abs(grid - time) <= 1.0]
        found += bool(np.interp(time, log.times, speeds) < 0.7 * around.mean())
    return found, len(switches)


def _under_budget(team: str, _: Sequence[Row]) -> list[Row]:
    """Return what a plan under the preset's budget takes, and how compiled runs of it end."""
    name, departures = f"smooth/budget/{team}", deployment_of({"preset": "mobile_base", "budget": "all"})
    ideal, _seconds = _planned(_scenario(team))
    made, seconds = _planned(_scenario(team, deployment=departures))
    assert made.motion is not None  # as in every plan of a team that passes
    assert made.departures is not None
    assert ideal.motion is not None
    transport = prepare(_scenario(team, deployment=departures), made, build_maps(made))
    outcomes = [run(transport, departures, seed=seed) for seed in range(RUNS)]
    return [
        Row(f"{name}/motion", made.motion.duration, "s", "ideal team", ideal.motion.duration),
        Row(f"{name}/room", 1e3 * float(made.departures.room[0]), "mm, of the position"),
        Row(f"{name}/arrived", sum(outcome.arrived for outcome in outcomes), "runs", "all", RUNS),
        Row(f"{name}/slowest", max(outcome.time for outcome in outcomes), "s"),
        Row(f"{name}/budget_share", max(outcome.budget_share for outcome in outcomes), "of the budget"),
        Row(f"{name}/alarm_share", max(outcome.alarm_share for outcome in outcomes), "of a level"),
        Row(f"{name}/force", max(outcome.peak_force for outcome in outcomes), "N"),
        Row(f"{name}/planning", seconds, "s"),
    ]
