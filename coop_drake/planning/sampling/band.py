"""Elastic bands: a path becomes shorter and moves away from the walls, so that long boxes fit."""

from __future__ import annotations

from itertools import takewhile

import numpy as np
from shapely import MultiPolygon, Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.jit import compiled
from coop_drake.planning.questions import SMALLEST_MARGIN, marginal_workspace
from coop_drake.planning.sampling.collision import (
    ALL,
    FAR,
    ObstacleGrid,
    bodies_apart,
    densified,
    grid_for_team,
    team_clearance,
)
from coop_drake.planning.sampling.sampler import (
    FEW_JOINTS,
    JOINT_RATE,
    SPEED,
    TURN_RATE,
    Sampler,
    SubsystemHierarchy,
)
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree, TeamArrays, configuration_scale, place_into

# Compiled elastic-band smoothing: paths become shorter in every axis and move away from obstacles.

STRIDES = (7, 3, 5, 1, 6, 2, 4, 0)
"""Order in which the samples of a move are checked, each offset with every eighth sample after it."""


@compiled(borrows=True)
def _price(
    team: TeamArrays, grid: ObstacleGrid, z: FloatArray, gap: float, rate: FloatArray, poses: FloatArray
) -> float:
    """Cost of a sample: rate[0] / (rate[1] + min(clearance, rate[2])), infinite where it is not free."""
    place_into(team, z, poses)
    clearance = team_clearance(team, grid, poses, rate[2], ALL)
    if clearance <= 0.0 or not bodies_apart(team, poses, gap, ALL):
        return np.inf
    price: float = rate[0] / (rate[1] + clearance)
    return price


@compiled
def improve(
    team: TeamArrays,
    grid: ObstacleGrid,
    rate: FloatArray,
    path: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    scale: FloatArray,
    weights: FloatArray,
    gap: float,
    free_end: bool,
    uniforms: FloatArray,
) -> FloatArray:
    """Lower the cost of a path move by move: bumps and straightenings of one axis over a window.

    The cost is the length in the sum of all weighted axes plus a price for every sample by its clearance.

    Args:
        team: The team.
        grid: The floor that the path stays on.
        rate: A sample with clearance c costs rate[0] / (rate[1] + min(c, rate[2])).
        path: Samples, close together, shape (m, d).
        lower: Lower limits, shape (d,); minus infinity where there is none.
        upper: Upper limits, shape (d,).
        scale: How far a unit of each axis moves the team, shape (d,).
        weights: What a unit of each axis costs, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        free_end: Whether the joints of the last sample may move.
        uniforms: Random numbers in [0, 1), one row for each move, shape (k, 5).
    """
    path = path.copy()
    count, size = path.shape
    cost, poses = np.empty(count), np.empty((len(team.links), 5))
    least = rate[0] / (rate[1] + rate[2])
    for k in range(count):
        cost[k] = _price(team, grid, path[k], gap, rate, poses)
    fresh = np.empty((count, size))
    fresh_cost = np.empty(count)
    for row in range(len(uniforms)):
        u = uniforms[row]
        axis = int(u[0] * size)
        half = 1 << int(u[1] * 7.0)
        middle = 1 + int(u[2] * (count - 1))
        last_free = free_end and axis > 2
        i = max(0, middle - half)
        j = min(count if last_free else count - 1, middle + half)
        if j - i < 2:
            continue
        straight = u[3] < 0.5
        shift = (2.0 * u[4] - 1.0) * 0.3 / scale[axis]
        change = 0.0
        for k in range(i + 1, j):
            fraction = (k - i) / (j - i)
            value = path[k, axis]
            if straight:
                end = path[j, axis] if j < count else path[i, axis]
                value = path[i, axis] + fraction * (end - path[i, axis])
            elif j == count:
                value += shift * min(1.0, 2.0 * fraction)
            else:
                value += shift * min(1.0, 3.0 * min(fraction, 1.0 - fraction))
            for other in range(size):
                fresh[k, other] = path[k, other]
            fresh[k, axis] = min(upper[axis], max(lower[axis], value))
            change += weights[axis] * abs(
                fresh[k, axis] - (path[k - 1, axis] if k == i + 1 else fresh[k - 1, axis])
            )
            change -= weights[axis] * abs(path[k, axis] - path[k - 1, axis])
        if j < count:
            change += weights[axis] * (
                abs(path[j, axis] - fresh[j - 1, axis]) - abs(path[j, axis] - path[j - 1, axis])
            )
        for k in range(i + 1, j):
            change += least - cost[k]
        # Most moves fail: samples far apart from each other show this soonest.
        for first in STRIDES:
            for k in range(i + 1 + first, j, len(STRIDES)):
                if change >= -1e-9:
                    break
                fresh_cost[k] = _price(team, grid, fresh[k], gap, rate, poses)
                change += fresh_cost[k] - least
        if change < -1e-9:
            for k in range(i + 1, j):
                path[k, axis] = fresh[k, axis]
                cost[k] = fresh_cost[k]
    return path


@compiled
def clearances(team: TeamArrays, grid: ObstacleGrid, path: FloatArray, most: float) -> FloatArray:
    """Distance of the team from the walls at every sample, at most ``most``; -1 where it meets one.

    Args:
        team: The team.
        grid: The floor.
        path: Configurations, shape (m, 3 + n).
        most: Distances above this one do not matter [m].

    Returns:
        Distances, shape (m,) [m].
    """
    result, poses = np.empty(len(path)), np.empty((len(team.links), 5))
    for k in range(len(path)):
        place_into(team, path[k], poses)
        result[k] = team_clearance(team, grid, poses, most, ALL)
    return result


# Elastic-band smoothing: a path becomes shorter and moves away from the walls, so that long boxes fit.

CLEARANCE_PRICE = 0.12
"""Cost of a unit length of the path for its narrowness, times the clearance there [m]."""

CLEARANCE_OFFSET = 0.005
"""It is added to clearances before they are divided by, so that costs stay finite [m]."""

SPACING = 0.1
"""Distance between samples of a path in any scaled axis, unless another one is asked for [m]."""

MOVES = 4_000
"""Changes of a path that are tried, unless another number is asked for."""

NARROWNESS_TIME, DURATION_OFFSET = 0.25, 0.02
"""Estimated duration of a unit length for its narrowness, times the clearance plus an offset [s], [m]."""

EXEMPT_DISTANCE = 2.0
"""Samples nearer to the start or goal than this many clearances may have less clearance than others, because
the start or goal may stand close to a wall [-]."""


def smoothed(
    problem: PlanningProblem,
    path: FloatArray,
    clearance: float,
    margin: float,
    gap: float,
    spacing: float = SPACING,
    moves: int = MOVES,
    price: float = CLEARANCE_PRICE,
) -> FloatArray:
    """Make a path shorter and move it away from the walls.

    Start and goal stay, but joints that are free at the goal may end elsewhere.

    Args:
        problem: The question.
        path: Configurations that keep the clearance, circular axes unwrapped, shape (m, 3 + n).
        clearance: Distance from the walls that the path keeps before and after [m].
        margin: Margin that the boxes must keep; only clearance above it makes them wide [m].
        gap: Distance that pairs of bodies keep [m].
        spacing: Distance between samples of the path in any scaled axis [m].
        moves: Changes that are tried.
        price: Cost of a unit length, times the clearance there; a larger one keeps the path further from
            the walls [m].

    Returns:
        The path, shape (k, 3 + n) [m, rad].
    """
    rate = np.array([price * spacing, max(clearance - margin, 0.0) + CLEARANCE_OFFSET, FAR])
    dense = densified(path, configuration_scale(problem.tree), spacing)
    weights = _speeds(problem.tree)[0] / _speeds(problem.tree)
    return improved(problem, marginal_workspace(problem, clearance), dense, rate, weights, gap, moves)


def improved(
    problem: PlanningProblem,
    floor: Polygon | MultiPolygon,
    path: FloatArray,
    rate: FloatArray,
    weights: FloatArray,
    gap: float,
    moves: int,
    seed: int = 0,
    *,
    free_end: bool = True,
) -> FloatArray:
    """Lower the cost of a path on a floor by random moves, see ``improve``.

    ``free_end``: whether it ends at the goal, where free joints may move.
    """
    tree = problem.tree
    team, unbounded = tree.arrays, np.full(3, np.inf)
    better: FloatArray = improve(
        team,
        grid_for_team(floor, team),
        rate,
        path,
        np.concatenate((-unbounded, tree.joint_lower)),
        np.concatenate((unbounded, tree.joint_upper)),
        configuration_scale(tree),
        weights,
        gap,
        free_end and all(value is None for value in problem.goal_joints),
        np.random.default_rng(seed).random((moves, 5)),
    )
    return better


def estimated_duration(problem: PlanningProblem, path: FloatArray) -> float:
    """Rough duration of a transport along a path, to compare candidates [s].

    Args:
        problem: The question.
        path: Configurations, circular axes unwrapped, shape (m, 3 + n).
    """
    scale, team = configuration_scale(problem.tree), problem.tree.arrays
    samples = densified(path, scale, SPACING)
    clear = np.maximum(clearances(team, grid_for_team(problem.workspace, team), samples, FAR), 0.0)
    moved = np.abs(np.diff(samples, axis=0))
    shifted = np.hypot(moved[:, 0], moved[:, 1])
    shortest = np.maximum(shifted / SPEED, (moved[:, 2:] / _speeds(problem.tree)[2:]).max(axis=1))
    swept = shifted + 0.5 * (moved[:, 2:] * scale[2:]).max(axis=1)
    return float(
        (shortest + NARROWNESS_TIME * swept / (np.minimum(clear[1:], clear[:-1]) + DURATION_OFFSET)).sum()
    )


def path_clearance(problem: PlanningProblem, path: FloatArray, most: float) -> float:
    """Smallest clearance of a path's samples, without those near an end that stands close to a wall itself.

    Args:
        problem: The question.
        path: Configurations, circular axes unwrapped, shape (m, 3 + n).
        most: Clearances above this one do not matter [m].

    Returns:
        The clearance; it is measured at samples and proves nothing [m].
    """
    scale, team = configuration_scale(problem.tree), problem.tree.arrays
    samples = densified(path, scale, 0.5 * SPACING)
    clear = clearances(team, grid_for_team(problem.workspace, team), samples, FAR)
    moved = [(np.abs(samples - samples[end]) * scale).sum(axis=1) for end in (0, -1)]
    exempt = np.minimum(*moved) / EXEMPT_DISTANCE
    least = most
    while True:
        below = clear[(clear < least) & (exempt > least)]
        if not len(below):
            return max(least, 0.0)
        least = float(below.min())


def _speeds(tree: ComponentTree) -> FloatArray:
    """Highest average speed of every axis of z, shape (3 + n,) [m/s, rad/s]."""
    return np.array([SPEED, SPEED, TURN_RATE, *[JOINT_RATE] * len(tree.joints)])


# Paths with clearance: the best of some candidates, moved away from the walls and then straightened.

BODY_GAP = 0.01
"""Distance that paths keep between bodies of the team [m]."""

LEAST_CLEARANCE = 0.002
"""Clearance that candidates keep [m], as paths of the first attempts do."""

SAMPLED_CLEARANCE = 0.015
"""Clearance that other candidates are sampled with [m]: wider ones are faster."""

CANDIDATES, CHOICES, CANDIDATE_SAMPLES, CANDIDATE_SEED = 2, 3, 2_500, 1
"""Number of other candidates, of paths of the object that each is chosen from, and of samples for every
subsystem; the seed of the samples."""

OTHER_CANDIDATES, OTHER_SAMPLES = 3, 4_000
"""The same for further paths, which are sampled for the whole team at once."""

COMPARED_MOVES = 1_200
"""Moves of smoothing after which candidates are compared: before it, random detours decide."""

WIDE_PRICE, WIDE_MOVES = 0.6, 2_000
"""Price of narrowness with which a path is moved away from the walls [m], five times the usual one, and the
number of moves."""

KEPT_FRACTION = 0.75
"""Fraction of its clearance that a path keeps while it is straightened [-]."""

STRAIGHTENINGS = (0.1, 2_000), (0.05, 800)
"""Spacing of samples [m] and number of moves with which it is straightened."""

NARROW, NARROW_SPACING, NARROW_MOVES, NARROW_REPEATS = 0.01, 0.02, 16_000, 3
"""A path with less clearance than this [m] is moved again with this spacing of samples [m], so many moves and
so many repetitions: in such a passage every millimetre saves a minute."""

NARROW_KEPT_FRACTION = 0.8
"""Fraction of its clearance that a path keeps meanwhile [-]."""

MARGIN_FRACTION, LEAST_FRACTION = 0.8, 0.35
"""Fraction of a path's clearance that counts as its margin, and the margin over the clearance above which
more does not matter [-]."""


def best_candidate(
    problem: PlanningProblem, hierarchy: SubsystemHierarchy, known: FloatArray, share: float = 1.0
) -> FloatArray:
    """The path with the shortest estimated duration among a known one and sampled ones.

    Sampled paths may turn the team in other directions. Sampling robot after robot stops at the first
    failure; a large team is then sampled as a whole.

    Args:
        problem: The question.
        hierarchy: Its subsystems.
        known: A free path, circular axes unwrapped, shape (m, 3 + n) [m, rad].
        share: Share of ``CANDIDATES`` that is sampled [-].
    """
    sampler = Sampler(hierarchy, marginal_workspace(problem, SAMPLED_CLEARANCE), BODY_GAP, CANDIDATE_SEED)
    most = round(share * CANDIDATES)
    sampled = [*takewhile(len, (sampler.path(CANDIDATE_SAMPLES, CHOICES) for _ in range(most)))]
    if len(sampled) < most and len(problem.goal_joints) > FEW_JOINTS:
        sampled += filter(len, (sampler.direct_path(OTHER_SAMPLES) for _ in range(most - len(sampled))))
    return _quickest(problem, [known, *sampled])


def another_candidate(
    problem: PlanningProblem, hierarchy: SubsystemHierarchy, number: int, share: float
) -> FloatArray | None:
    """The path with the shortest estimated duration among sampled ones, None if none is found.

    Args:
        problem: The question.
        hierarchy: Its subsystems.
        number: Other samples are drawn for every number (1, 2, ...).
        share: Share of ``OTHER_CANDIDATES`` that is sampled [-], at least one.
    """
    sampler = Sampler(
        hierarchy, marginal_workspace(problem, SAMPLED_CLEARANCE), BODY_GAP, CANDIDATE_SEED + number
    )
    sampled = (sampler.direct_path(OTHER_SAMPLES) for _ in range(max(1, round(share * OTHER_CANDIDATES))))
    paths = [path for path in sampled if len(path)]
    return _quickest(problem, paths) if paths else None


def _quickest(problem: PlanningProblem, paths: list[FloatArray]) -> FloatArray:
    """The path with the shortest estimated duration after a short smoothing."""
    tight = [smoothed(problem, path, LEAST_CLEARANCE, 0.0, BODY_GAP, moves=COMPARED_MOVES) for path in paths]
    return min(tight, key=lambda path: estimated_duration(problem, path))


def moved_from_obstacles(problem: PlanningProblem, path: FloatArray, share: float = 1.0) -> FloatArray:
    """Move a path away from the walls, and straighten it such that it keeps most of that clearance.

    Args:
        problem: The question.
        path: A free path, circular axes unwrapped, shape (m, 3 + n) [m, rad].
        share: Share of the usual number of moves that is tried [-].
    """
    most = problem.settings.margin / LEAST_FRACTION
    path = smoothed(
        problem, path, LEAST_CLEARANCE, 0.0, BODY_GAP, moves=round(share * WIDE_MOVES), price=WIDE_PRICE
    )
    clearance = max(KEPT_FRACTION * path_clearance(problem, path, most), LEAST_CLEARANCE)
    for spacing, moves in STRAIGHTENINGS:
        path = smoothed(problem, path, clearance, clearance, BODY_GAP, spacing, round(share * moves))
    return centred_in_narrow_passages(problem, path)


def centred_in_narrow_passages(problem: PlanningProblem, path: FloatArray) -> FloatArray:
    """Move a path with less clearance than ``NARROW`` to the middle of its passages; others stay the same.

    Args:
        problem: The question.
        path: A free path, circular axes unwrapped, shape (m, 3 + n) [m, rad].
    """
    clearance = path_clearance(problem, path, NARROW)
    for _ in range(NARROW_REPEATS if 0.0 < clearance < NARROW else 0):
        kept = NARROW_KEPT_FRACTION * clearance
        wider = smoothed(problem, path, kept, 0.0, BODY_GAP, NARROW_SPACING, NARROW_MOVES, WIDE_PRICE)
        reached = path_clearance(problem, wider, NARROW)
        if reached <= clearance:
            break
        path, clearance = wider, reached
    return path


def kept_margin(problem: PlanningProblem, path: FloatArray) -> float:
    """The margin that a path keeps at its samples, zero where it is too small to be worth it [m].

    Args:
        problem: The question, whose settings hold the largest margin.
        path: A free path, circular axes unwrapped, shape (m, 3 + n) [m, rad].
    """
    largest = problem.settings.margin
    margin = min(MARGIN_FRACTION * path_clearance(problem, path, largest / MARGIN_FRACTION), largest)
    return margin if margin >= SMALLEST_MARGIN else 0.0
