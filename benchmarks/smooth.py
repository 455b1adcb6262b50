"""Teams that pass beside teams that rest: times, stops, limits, squeezing; budgets at three speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from time import process_time

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from shapely import Polygon

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
from coop_drake.scenario import Deployment, RobotDepartures, with_gains
from coop_drake.scenario.model import RobotLimits
from coop_drake.simulation import simulate
from coop_drake.tree.arrays import FloatArray

QUICKEST = {"base": 12.2, "tight": 13.0, "three": 13.2, "elbow": 12.1, "warehouse": 11.7}
"""The quickest ways through the floors at these limits that an uncertified search found once [s]."""

RUNS = 200
"""Compiled runs of each team under the preset where the command line says nothing else."""

SPEEDS = (0.5, 1.0, 1.5)
"""Limits of the bases' speed at which plans under the preset's budget are asked for [m/s]."""

CLOCKS = 0.002
"""By how much clocks are ahead and behind in turn where squeezing is measured [s]."""

_PRESET = {"preset": "mobile_base", "budget": "all"}

LIMITS = {
    "*": RobotLimits(
        1.0, 1.0, (1.0,), (2.0,), base_acceleration=1.0, base_turn_acceleration=2.0, base_jerk=10.0
    ),
    "object": RobotLimits(acceleration=1.5),
}
"""Bases at 1 m/s, 1 rad/s, 1 m/s^2, 2 rad/s^2 and 10 m/s^3, the object at 1.5 m/s^2, joints at 1 and 2."""


def smooth_tasks(runs: int = RUNS) -> list[Task]:
    """Each shipped team: the ideal one, that of the preset under its budget, and plans at other speeds.

    Args:
        runs: Compiled runs of each team under the preset.
    """
    return [
        *(Task(f"smooth/ideal/{team}", partial(_ideal, team)) for team in QUICKEST),
        *(Task(f"smooth/budget/{team}", partial(_under_budget, team, runs)) for team in QUICKEST),
        *(Task(f"smooth/speeds/{team}", partial(_at_speeds, team)) for team in QUICKEST),
    ]


def limited_scenario(team: str, **changes: object) -> Scenario:
    """Return a shipped scenario with the limits of this benchmark, and other changes."""
    scenario = load_scenario(team)
    return replace(scenario, limits=LIMITS, **changes)  # type: ignore[arg-type]


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
    scenario, name = limited_scenario(team), f"smooth/ideal/{team}"
    made, seconds = _planned(scenario)
    others, of_others = _planned(with_gains(scenario, "scheduled"))
    estimated = sum(one.estimated_time for one in others.transitions)
    maps = build_maps(made)
    log = simulate(scenario, made, maps)
    clocks = {
        robot: RobotDepartures(clock_error=CLOCKS * (-1.0) ** k) for k, robot in enumerate(log.robot_names)
    }
    apart = simulate(replace(scenario, deployment=Deployment(control_rate=200.0, robots=clocks)), made, maps)
    if not apart.reached:
        raise PlanError(f"{scenario.path}: with clocks {CLOCKS:g} s off: {apart.violation}")
    shares = np.array([scenario.load_share(robot, len(log.robot_names)) for robot in log.robot_names])
    shortest = shortest_way([cell.tidied for cell in made.cells], log.object_pose[[0, -1], :2])
    way = float(np.hypot(*np.diff(log.object_pose[:, :2], axis=0).T).sum())
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
        Row(f"{name}/squeezing", squeezing_of(log, shares), "N"),
        Row(f"{name}/squeezing_clocks", squeezing_of(apart, shares), "N"),
        Row(f"{name}/way", way, "m", "shortest in the cells' regions", shortest),
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


def squeezing_of(log: SimulationLog, shares: FloatArray) -> float:
    """Return the largest force with which a robot pushes against the others through the object [N].

    It is the length of F_k - w_k (F_1 + ... + F_N), F_k the force of robot k on the object as the plant has
    it, and w_k the robot's share of the load. These forces add up to zero, whatever moves the object.

    Args:
        log: The run.
        shares: w, shape (N,), which add up to one [-].
    """
    forces = log.measured_wrenches[..., :2]
    pushed = forces - shares[:, None] * forces.sum(axis=1, keepdims=True)
    return float(np.hypot(pushed[..., 0], pushed[..., 1]).max())


def shortest_way(regions: Sequence[Polygon], ends: FloatArray) -> float:
    """Return the length of the shortest path from one point to another in the union of regions [m].

    It may take cells of a plan in another order than the plan, so that no way through them is shorter. Such
    a path runs straight between its ends and corners of the union: Dijkstra's algorithm finds it among all
    pairs that see each other.

    Args:
        regions: The regions [m].
        ends: The two points, shape (2, 2) [m].
    """
    union = shapely.union_all(regions)
    corners = shapely.get_coordinates(union.simplify(0.0))
    places = np.vstack([ends, np.unique(corners, axis=0)])
    first, second = np.triu_indices(len(places), 1)
    lines = shapely.linestrings(places[np.stack([first, second], axis=1)])
    room = union.buffer(1e-9)  # Lines along a boundary are not to be lost by rounding.
    shapely.prepare(room)
    seen = shapely.covers(room, lines)
    lengths = (np.hypot(*(places[first] - places[second])[seen].T), (first[seen], second[seen]))
    sight = coo_array(lengths, shape=(len(places), len(places)))
    return float(dijkstra(sight.tocsr(), directed=False, indices=[0])[0, 1])


def _at_speeds(team: str, _: Sequence[Row]) -> list[Row]:
    """Return what plans take under the preset's budget at several speeds of the bases, or what is said."""
    rows = []
    for speed in SPEEDS:
        limits = {**LIMITS, "*": replace(LIMITS["*"], base_speed=speed)}
        ideal = replace(limited_scenario(team), limits=limits)
        begun, compiling = process_time(), COMPILING.cpu_seconds
        result = plan(replace(ideal, deployment=deployment_of(_PRESET)))
        seconds = process_time() - begun - COMPILING.cpu_seconds + compiling
        name, found = f"smooth/speeds/{team}_at_{speed:g}", isinstance(result, Found)
        rows.append(Row(f"{name}/answer", float(found), "found" if found else type(result).__name__.lower()))
        rows.append(Row(f"{name}/planning", seconds, "s"))
        if isinstance(result, Found):
            times = [
                sum(one.estimated_time for one in made.transitions)
                for made in (result.plan, _planned(ideal)[0])
            ]
            rows.append(Row(f"{name}/motion", times[0], "s", "ideal team", times[1]))
    return rows


def _under_budget(team: str, runs: int, _: Sequence[Row]) -> list[Row]:
    """Return what a plan under the preset's budget takes, and how compiled runs of it end."""
    name, departures = f"smooth/budget/{team}", deployment_of(_PRESET)
    ideal, _seconds = _planned(limited_scenario(team))
    made, seconds = _planned(limited_scenario(team, deployment=departures))
    assert made.motion is not None  # as in every plan of a team that passes
    assert made.departures is not None
    assert ideal.motion is not None
    transport = prepare(limited_scenario(team, deployment=departures), made, build_maps(made))
    most, random = departures.mass_error, np.random.default_rng(0)
    outcomes = [
        run(transport, replace(departures, mass_error=float(error)), seed=seed)
        for seed, error in enumerate(random.uniform(-most, most, runs))
    ]
    return [
        Row(f"{name}/motion", made.motion.duration, "s", "ideal team", ideal.motion.duration),
        Row(f"{name}/room", 1e3 * float(made.departures.room[0]), "mm, of the position"),
        Row(f"{name}/arrived", sum(outcome.arrived for outcome in outcomes), "runs", "all", runs),
        Row(f"{name}/held", sum(outcome.held > 0 for outcome in outcomes), "runs"),
        Row(f"{name}/slowest", max(outcome.time for outcome in outcomes), "s"),
        Row(f"{name}/budget_share", max(outcome.budget_share for outcome in outcomes), "of the budget"),
        Row(f"{name}/alarm_share", max(outcome.alarm_share for outcome in outcomes), "of a level"),
        Row(f"{name}/wall", 1e3 * min(outcome.wall_clearance for outcome in outcomes), "mm"),
        Row(f"{name}/force", max(outcome.peak_force for outcome in outcomes), "N"),
        Row(f"{name}/planning", seconds, "s"),
    ]
