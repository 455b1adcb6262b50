"""The quickest motion of a team that a search without proofs finds: a judge of the motions of plans.

A way is a cubic B-spline z(s) of configurations z = (x, y, theta, q...), s from 0 to 1. Along it the team
runs from rest to rest at the pace that takes the least time within all limits. With x = s'^2 and u = s'', a
point moves at V s' and accelerates by V u + A x, V and A being derivatives by s; both lengths are limited.
At stages along s, from the last to the first, the largest x is found from which the team can still brake;
then, from the first to the last, the largest u with which it stays below. This is TOPP-RA (Pham and Pham,
IEEE Transactions on Robotics 34(3), 2018, doi:10.1109/TRO.2018.2819195), with limits on lengths in place of
facets.

The search begins with the way of the plan that is judged, with the paths through its cells, and with ways of
OMPL and of compiled random trees. It moves control points at random, and keeps a move if the way takes less
time and no body comes nearer to a wall than allowed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from benchmarks.isolated import in_own_process
from benchmarks.questions.answering import planned_in_time
from benchmarks.questions.floors import Random
from benchmarks.questions.peers import has_ompl, run_ompl, run_trees
from benchmarks.questions.question import random_question
from benchmarks.questions.settings import QuestionSettings
from benchmarks.rows import Row
from benchmarks.smooth import LIMITS, QUICKEST, limited_scenario
from benchmarks.tasks import Task
from coop_drake.answers import Found, Plan, PlanningProblem
from coop_drake.errors import PlanError
from coop_drake.jit import compiled
from coop_drake.planning import motion
from coop_drake.planning.motion_limits import Chains, follow, motion_limits, team_chains
from coop_drake.planning.sampling.band import EXEMPT_DISTANCE, clearances, path_clearance
from coop_drake.planning.sampling.collision import ALL, ObstacleGrid, bodies_apart, densified, grid_for_team
from coop_drake.planning.sampling.trees import shortened
from coop_drake.plant import planning_problem
from coop_drake.scenario import Scenario
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import TeamArrays, configuration_scale, place_into
from coop_drake.verification.runs.bodies import component_stages, least_distances, points_in_world, turns

CLEARANCE, RESERVE, BODY_GAP = 0.03, 1e-3, 1e-3
"""Distance from walls, or that of the motion judged if it is less; what the search keeps besides, for places
between those that it looks at; and distance between bodies that must not meet [m]. Nearer to an end than
``EXEMPT_DISTANCE`` times this distance less is allowed, for both, as an end may stand close to a wall."""

SPACING, FEWEST, MOST = 0.3, 20, 80
"""Way of the team for each control point, about [m], and bounds of their number [-]."""

STAGES, FINE, CHECK_STEP = 5, 20, 0.01
"""Stages of the pace for each control point in the search, and then of the way that is found [-]; distance
between places where clearance is looked at, about [m]."""

TRIALS, LARGEST_MOVE, DECADES, WIDTH = 500, 0.3, 2.5, 10
"""Moves tried for each control point of every way [-]; the largest [m], by how many powers of ten others are
smaller, and how many control points to either side move along at most [-]."""

LACKING = 1e3
"""What a lack of clearance costs while a way has one [s/m]."""

SEEDS, TREE_CHECKS, OMPL_TIME, SHORT_CUTS = (1, 2), 100_000, 8.0, 3_000
"""Seeds of other planners, what each run may check [-] or take [CPU s], and short cuts tried [-]."""

WITHIN, ASKED, PATIENCE, TIME_LIMIT = 1.03, 20, 60.0, 900.0
"""Times of the judge over recorded ones with which it may judge [-]; random questions that it judges [-];
when their first plan must be there, and time of a process that makes and judges it [CPU s]."""


class Team(NamedTuple):
    """What a way is of.

    Attributes:
        arrays: The team.
        grid: The floor.
        chains: The bases.
        limits: Largest speed and acceleration of the object, the bases, their angles and the joints, (P, 2).
        ranges: Lower and upper limits of z, shape (2, 3 + n).
        loose: 1 for axes of z whose end is free, 0 for others, shape (3 + n,).
        scale: How far a unit of each axis moves the team, shape (3 + n,).
        clearance: Distance from walls that is kept where it is looked at [m].
    """

    arrays: TeamArrays
    grid: ObstacleGrid
    chains: Chains
    limits: FloatArray
    ranges: FloatArray
    loose: FloatArray
    scale: FloatArray
    clearance: float


def spline(points: FloatArray) -> BSpline[np.float64]:
    """Return the spline over s that begins and ends in its first and last control point."""
    inner = np.linspace(0.0, 1.0, len(points) - 2)
    return BSpline(np.concatenate([np.zeros(3), inner, np.ones(3)]), points, 3)


def shares_of(samples: int, points: int) -> FloatArray:
    """Return the shares of control points in z, z_s and z_ss at even places s, (3, samples, points)."""
    basis, s = spline(np.eye(points)), np.linspace(0.0, 1.0, samples)
    return np.stack([basis(s), basis(s, nu=1), basis(s, nu=2)])


@compiled
def touched(shares: FloatArray, low: int, high: int) -> tuple[int, int]:
    """Return the first sample that depends on points from low to high - 1, and the one after the last."""
    # Point j has a share where s is between (j - 3) / (points - 3) and (j + 1) / (points - 3).
    spacing = (shares.shape[1] - 1) / (shares.shape[2] - 3)
    return max(0, int(np.ceil((low - 3) * spacing))), min(shares.shape[1], int(high * spacing) + 1)


# The pace.


@compiled
def derive(
    team: Team, stages: FloatArray, points: FloatArray, begin: int, end: int, moved: FloatArray
) -> None:
    """Write V and A of all that is limited at some stages, shape (stages, P, 2, 2)."""
    x, v, a = stages[0, begin:end] @ points, stages[1, begin:end] @ points, stages[2, begin:end] @ points
    by = np.empty((4, 2, points.shape[1]))
    for i in range(end - begin):
        for p in range(len(team.limits)):
            follow(team.chains, p, x[i], v[i], a[i], moved[begin + i, p], by, False)


@compiled(borrows=True)
def range_of(
    here: FloatArray, there: FloatArray, limits: FloatArray, step: float, x: float
) -> tuple[float, float]:
    """Return the least and the largest u between two stages, the first above the second if there is none.

    Accelerations are limited at both stages, or fewer stages would allow more; at the second x is larger by
    ``step`` u.
    """
    low, high = -inf, inf
    for p in range(len(limits)):
        for after in range(2):
            at = there[p] if after else here[p]
            ax, ay = at[1, 0], at[1, 1]
            vx, vy = at[0, 0] + after * step * ax, at[0, 1] + after * step * ay
            a, b = vx * vx + vy * vy, (vx * ax + vy * ay) * x
            c = (ax * ax + ay * ay) * x * x - limits[p, 1] * limits[p, 1]
            root = b * b - a * c
            if root < 0.0 or (a < 1e-12 and c > 0.0):
                return inf, -inf
            if a >= 1e-12:
                root = np.sqrt(root)
                low, high = max(low, (-b - root) / a), min(high, (-b + root) / a)
    return low, high


@compiled(borrows=True)
def pace(moved: FloatArray, limits: FloatArray, x: FloatArray) -> float:
    """Write the squared pace at every stage, zero at both ends; return the time that the way takes [s]."""
    n = len(x)
    step = 2.0 / (n - 1)
    x[n - 1] = 0.0
    for i in range(n - 2, -1, -1):
        most = inf
        for p in range(len(limits)):
            speed = moved[i, p, 0, 0] ** 2 + moved[i, p, 0, 1] ** 2
            if speed > 0.0:
                most = min(most, limits[p, 0] ** 2 / speed)
        # All x up to the largest one can be braked, so that bisection finds it.
        x[i], value = 0.0, most
        for _ in range(22):
            low, high = range_of(moved[i], moved[i + 1], limits, step, value)
            if low <= high and value + step * low <= x[i + 1]:
                x[i] = value
                if value == most:
                    break
            else:
                most = value
            value = 0.5 * (x[i] + most)
    seconds, x[0] = 0.0, 0.0
    for i in range(n - 1):
        high = range_of(moved[i], moved[i + 1], limits, step, x[i])[1]
        x[i + 1] = max(0.0, min(x[i + 1], x[i] + step * high))
        seconds += step / max(np.sqrt(x[i]) + np.sqrt(x[i + 1]), 1e-9)
    return seconds


# The search.


@compiled
def exempt(team: Team, z: FloatArray, way: FloatArray) -> float:
    """Return how much clearance is asked for at most, that near to an end of a way [m]."""
    first, last = (np.abs(z - way[0]) * team.scale).sum(), (np.abs(z - way[-1]) * team.scale).sum()
    return float(min(first, last) / EXEMPT_DISTANCE)


@compiled
def lacking(team: Team, checks: FloatArray, points: FloatArray, begin: int, end: int) -> FloatArray:
    """Return by how much clearance falls short at some places, excess of joints added, (checks,) [m]."""
    z, poses = checks[0, begin:end] @ points, np.empty((len(team.arrays.links), 5))
    clear, lacks = clearances(team.arrays, team.grid, z, team.clearance), np.zeros(len(z))
    for i in range(len(z)):
        lacks[i] = max(0.0, min(team.clearance, exempt(team, z[i], points)) - clear[i])
        place_into(team.arrays, z[i], poses)
        lacks[i] += 0.0 if bodies_apart(team.arrays, poses, BODY_GAP, ALL) else 1.0
        lacks[i] += np.maximum(0.0, np.maximum(team.ranges[0] - z[i], z[i] - team.ranges[1])).sum()
    return lacks


@compiled
def move(team: Team, points: FloatArray, random: Random) -> tuple[int, int]:
    """Move some neighbouring control points along some axes; return the first and the one after the last."""
    m, width = len(points), int(random.integers(1, WIDTH))
    middle = int(random.integers(0, m))
    low, high = max(1, middle - width), min(m, middle + width + 1)
    size = LARGEST_MOVE * 10.0 ** (-DECADES * random.random())
    for axis in range(points.shape[1]):
        by = size * random.normal() / team.scale[axis] if random.random() < 0.5 else 0.0
        for j in range(low, high):
            share = np.exp(-2.0 * ((j - middle) / width) ** 2)
            points[j, axis] += by * share * (1.0 if j < m - 1 else team.loose[axis])
    return low, high


@compiled
def improve(
    team: Team, stages: FloatArray, checks: FloatArray, points: FloatArray, trials: int, random: Random
) -> tuple[float, float]:
    """Move control points where that saves time; return the way's time [s], and what clearance lacks [m]."""
    n = stages.shape[1]
    moved, x, trial = np.zeros((n, len(team.limits), 2, 2)), np.empty(n), points.copy()
    derive(team, stages, points, 0, n, moved)
    seconds, tried = pace(moved, team.limits, x), moved.copy()
    lacks = lacking(team, checks, points, 0, checks.shape[1])
    lack = lacks.sum()
    for _ in range(trials):
        low, high = move(team, trial, random)
        begin, end = touched(stages, low, high)
        derive(team, stages, trial, begin, end, tried)
        took, kept = pace(tried, team.limits, x), False
        if took < seconds or lack > 0.0:
            first, last = touched(checks, low, high)
            new = lacking(team, checks, trial, first, last)
            kept = took + LACKING * (new.sum() - lacks[first:last].sum()) < seconds
        if kept:
            seconds, points[low:high], moved[begin:end] = took, trial[low:high], tried[begin:end]
            lacks[first:last] = new
            lack = lacks.sum()
        else:
            trial[low:high], tried[begin:end] = points[low:high], moved[begin:end]
    return seconds, lack


@dataclass(frozen=True)
class Quickest:
    """The quickest motion that was found.

    Attributes:
        seconds: What it takes with all limits kept, also between stages [s].
        points: Control points of its way, shape (m, 3 + n).
        ways: What the way that each start led to takes, of those that keep the clearance [s].
        clearance: The distance from walls that was asked for [m].
    """

    seconds: float
    points: FloatArray
    ways: dict[str, float]
    clearance: float


def quickest(problem: PlanningProblem, made: Plan, trials: int = TRIALS) -> Quickest:
    """Search for the quickest motion from the start to the goal of a question.

    Args:
        problem: The question, with the limits that count.
        made: The plan whose motion is judged.
        trials: Moves that are tried for each control point of a way.

    Raises:
        PlanError: No way that was found stands the check of its clearance.
    """
    team = team_of(problem, sampled(made))
    found: dict[str, tuple[float, FloatArray]] = {}
    for name, path in starting_ways(problem, made, team):
        points, length = control_points(path, team.scale)
        m = len(points)
        stages, checks = shares_of(STAGES * m, m), shares_of(int(length / CHECK_STEP) + m, m)
        seconds, lack = improve(team, stages, checks, points, trials * m, np.random.default_rng(0))
        if lack == 0.0:
            found[name] = seconds, points
    room = max(team.clearance - RESERVE, 0.0)
    narrow = replace(problem, workspace=problem.workspace.buffer(-room, quad_segs=32))
    while found:
        points = found[best := min(found, key=lambda name: found[name][0])][1]
        seconds, rows = timed(team, points)
        # Where the exemption ends, clearance may change by more between two places than is kept in reserve.
        inner = rows[[exempt(team, z, points) > 2.0 * team.clearance for z in rows]]
        if min(least_distances(problem, rows).min(), least_distances(narrow, inner).min()) > 0.0:
            ways = {name: way[0] for name, way in found.items()}
            return Quickest(seconds * largest_share(problem, rows, seconds), points, ways, room)
        del found[best]
    raise PlanError(f"no way was found that stands the check of a clearance of {room:.3g} m")


def team_of(problem: PlanningProblem, judged: FloatArray) -> Team:
    """Return what the search needs; the clearance is that of the motion judged, (T, 3 + n), if it is less."""
    tree, chains, unbounded = problem.tree, team_chains(problem), np.full(3, inf)
    count = 1 + 2 * chains.bases + len(tree.joints)  # What follows are forces.
    limits = np.ascontiguousarray(motion_limits(problem.limits)[:count, :2])
    grid = grid_for_team(problem.workspace, tree.arrays)
    clearance = path_clearance(problem, judged, CLEARANCE + RESERVE)
    ranges = np.stack([np.append(-unbounded, tree.joint_lower), np.append(unbounded, tree.joint_upper)])
    loose = np.array([0.0] * 3 + [float(goal is None) for goal in problem.goal_joints])
    scale = configuration_scale(tree)
    return Team(tree.arrays, grid, chains, limits, ranges, loose, scale, clearance)


def sampled(made: Plan) -> FloatArray:
    """Return configurations of a plan's motion at equal steps of the time, shape (T, 3 + n)."""
    assert made.motion is not None  # as in every plan of a team that passes
    spans = len(made.motion.points) - 3
    course = BSpline(np.arange(spans + 7) - 3.0, made.motion.points, 3)
    return np.ascontiguousarray(course(np.linspace(0.0, spans, 20 * spans)))


def starting_ways(problem: PlanningProblem, made: Plan, team: Team) -> Iterator[tuple[str, FloatArray]]:
    """Yield paths, shape (m, 3 + n): the motion judged, through its cells, and those of other planners."""
    yield "motion", sampled(made)
    cells, table = motion.cell_sets(made, None), motion_limits(problem.limits)
    ways = motion.first_ways(made)
    yield "cells", motion.first_points(ways, cells, team.chains, table, motion.OVERLAP_SPANS)[:, :-1]
    # A part of the clearance is enough here: the search mends what a narrow passage lacks.
    at_ends = clearances(team.arrays, team.grid, sampled(made)[[0, -1]], team.clearance).min()
    narrow = replace(problem, workspace=problem.workspace.buffer(-min(team.clearance / 3.0, 0.9 * at_ends)))
    runs = [(f"trees {run.seed}", run) for run in run_trees(narrow, SEEDS, TREE_CHECKS)]
    if has_ompl():
        runs += [(f"OMPL {run.seed}", run) for run in run_ompl(narrow, SEEDS, OMPL_TIME)]
    grid = grid_for_team(narrow.workspace, team.arrays)
    for name, run in runs:
        if run.found:
            path, random = densified(run.path, team.scale, 0.1), np.random.default_rng(run.seed)
            uniforms = random.random((SHORT_CUTS, 3))
            yield name, shortened(team.arrays, grid, path, team.scale, BODY_GAP, 0.01, uniforms)


def control_points(path: FloatArray, scale: FloatArray) -> tuple[FloatArray, float]:
    """Return control points at equal steps of the scaled length of a path, ends included, and it [m]."""
    places = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0) * scale, axis=1)))
    at = np.linspace(0.0, places[-1], int(np.clip(places[-1] / SPACING, FEWEST, MOST)))
    return np.stack([np.interp(at, places, column) for column in path.T], axis=1), float(places[-1])


def timed(team: Team, points: FloatArray) -> tuple[float, FloatArray]:
    """Return the time of a way [s], and its configurations at equal steps of the time, one for each stage."""
    n = FINE * len(points)
    moved, x, step = np.zeros((n, len(team.limits), 2, 2)), np.empty(n), 1.0 / (n - 1)
    derive(team, shares_of(n, len(points)), points, 0, n, moved)
    seconds, speeds = pace(moved, team.limits, x), np.sqrt(x)
    times = np.append(0.0, np.cumsum(2.0 * step / np.maximum(speeds[:-1] + speeds[1:], 1e-9)))
    asked = np.linspace(0.0, times[-1], n)
    i = np.clip(np.searchsorted(times, asked, side="right") - 1, 0, n - 2)
    since = asked - times[i]
    s = i * step + since * speeds[i] + since**2 * np.diff(x)[i] / (4.0 * step)
    return seconds, np.asarray(spline(points)(np.clip(s, 0.0, 1.0)))


def largest_share(problem: PlanningProblem, rows: FloatArray, seconds: float) -> float:
    """Return how many times slower a motion must be to keep every limit, by differences of its rows [-].

    These are configurations at equal steps of the time, shape (T, 3 + n). Bases are where the verifier finds
    them: nothing of the search is used.
    """
    known, step = problem.limits.with_defaults(), seconds / (len(rows) - 1)
    limited = [(rows[:, :2], inf, known.object_acceleration[0])]
    for k, (component, point) in enumerate(zip(known.base_components, known.base_points, strict=True)):
        stages = component_stages(problem.tree, component)
        place, angle = points_in_world(np.array([point]), stages, rows)[:, 0], turns(stages, rows)[:, None]
        limited.append((place, known.base_speeds[k], known.base_accelerations[k]))
        limited.append((angle, known.turn_rates[k], known.turn_accelerations[k]))
    rates = zip(known.joint_rates, known.joint_accelerations, strict=True)
    limited += [(rows[:, 3 + k, None], *most) for k, most in enumerate(rates)]
    shares = [1.0]
    for places, speed, acceleration in limited:
        first, second = (np.linalg.norm(np.diff(places, order, axis=0), axis=1).max() for order in (1, 2))
        shares += [first / step / speed, np.sqrt(second / step**2 / acceleration)]
    return float(max(shares))


# What is measured.


def quickest_tasks() -> list[Task]:
    """The judge on shipped teams, and then on random questions."""
    return [
        *(Task(f"smooth/judge/{team}", partial(_judge, team)) for team in QUICKEST),
        Task("smooth/questions", _questions, alone=True),
    ]


def _judge(team: str, _: Sequence[Row]) -> list[Row]:
    """Return what the judge finds for a shipped team beside what was recorded, and the plan beside it."""
    answer = in_own_process(judged, limited_scenario(team), limit=TIME_LIMIT).value
    if answer is None:
        raise PlanError(f"{team}: no plan, or not judged within {TIME_LIMIT:g} CPU s")
    (ours, found), name = answer, f"smooth/judge/{team}"
    return [
        Row(f"{name}/quickest", found.seconds, "s", "recorded", QUICKEST[team]),
        Row(f"{name}/motion", ours, "s", "quickest", found.seconds),
        Row(f"{name}/clearance", 1e3 * found.clearance, "mm"),
        Row(f"{name}/ways", len(found.ways), "ways"),
        Row(f"{name}/slowest_way", max(found.ways.values()), "s", "quickest", found.seconds),
    ]


def judged(scenario: Scenario) -> tuple[float, Quickest] | None:
    """Return what the motion of a plan takes [s], and the quickest one found; None without a plan."""
    problem = planning_problem(scenario)
    answer = planned_in_time(scenario, problem, PATIENCE)[0]
    if not isinstance(answer, Found) or answer.plan.motion is None:
        return None
    return answer.plan.motion.duration, quickest(problem, answer.plan)


def _questions(rows: Sequence[Row]) -> list[Row]:
    """Return what the motions of the first random questions take beside the judge's, if it may judge."""
    ratios = {row.name: row.ratio or inf for row in rows}
    for team in QUICKEST:
        if not ratios.get(f"smooth/judge/{team}/quickest", inf) <= WITHIN:
            raise PlanError(f"{team}: the judge may judge once it is within {WITHIN:g} of what is recorded")
    found, ask = list[Row](), partial(in_own_process, question_judged, limit=TIME_LIMIT)
    with ThreadPoolExecutor(2) as pool:
        pending = deque((number, pool.submit(ask, number)) for number in range(3))
        while len(found) < ASKED:
            number, done = pending.popleft()
            pending.append((pending[-1][0] + 1, pool.submit(ask, pending[-1][0] + 1)))
            if (answer := done.result().value) is not None:
                name = f"smooth/questions/{number}/motion"
                found.append(Row(name, answer[0], "s", "quickest", answer[1].seconds))
        pool.shutdown(cancel_futures=True)
    times = [row.ratio or inf for row in found]
    largest = Row("smooth/questions/all/largest", max(times), "of the quickest")
    return [*found, Row("smooth/questions/all/median", float(np.median(times)), "of the quickest"), largest]


def question_judged(number: int) -> tuple[float, Quickest] | None:
    """Judge the motion of a random question's plan, see ``judged``."""
    with TemporaryDirectory() as folder:
        question = random_question(QuestionSettings(), number, Path(folder))
        return judged(replace(question.scenario, limits=LIMITS))
