"""Narrow-passage repair: a path for an easier question is moved until it answers the original one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.parts import parts_of
from coop_drake.planning.sampling.clearance_program import with_wider_passages
from coop_drake.planning.sampling.collision_kernels import first_collision, is_free
from coop_drake.planning.sampling.densify import densified
from coop_drake.planning.sampling.elastic_band_kernels import improve
from coop_drake.planning.sampling.obstacle_grid import grid_for_team
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

BODY_GAP = 0.002
"""Distance that bodies of the team keep from each other [m]."""

PRICES = (0.04, 5e-4, 0.1)
"""A sample with clearance c costs [0] / ([1] + min(c, [2])) [m]: steep, so the narrowest place counts."""

SPACING = 0.05
"""Distance between samples of a path in any scaled axis [m]."""

MOVES = 2_000
"""Changes of a path that are tried at a time."""

WINDOW = 40
"""Later changes are confined to this many samples on each side of the narrowest one: two metres of path."""

HALVINGS = 10
"""Bisections of an amount: the result is exact to a thousandth of the amount."""

ROUNDS_OF_MOVES = 6
"""Times that a path is moved before it is given up."""

REPAIRS = 3
"""Times that this is repeated while it helps."""

LEAST_CLEARANCE = 0.001
"""Walls are moved in by this, so that boxes around the repaired path have a width [m]."""

MITRE_LIMIT = 5.0
"""Corners of a widened floor are cut at this many times the widening [-]."""

FINE_SPACINGS = (0.02, 0.005)
"""Distances between samples of a path that is moved to the middle of its narrowest passages, in any scaled
axis [m]: a turn by 5 mm between two samples lifts a point by 5 um off the line between them."""

CHORD = 0.001
"""Between samples of a path it needs at most this much more easing than at them [m]."""

LARGEST_MOVE, SMALLEST_MOVE, SHORTER = 0.01, 2e-5, 0.3
"""Moves of samples that are tried, the largest first, and the factor between them [m, m, -]."""

STRETCH = 1.5
"""Samples may move apart up to this many spacings [-]."""

LEAST_GAIN = 1e-6
"""Moves that ease a path by less are of no use [m]."""

SOLVED_FRACTION = 0.1
"""A path is repaired when it needs less than this fraction of ``LEAST_CLEARANCE`` [-]."""

PROGRESS_FRACTION = 0.8
"""Repairs go on while the amount needed falls below this fraction of the amount before [-]."""

Eased = Callable[[float], PlanningProblem]
"""The question made easier by an amount; what is free for one amount is free for every larger one."""


def ease_less(eased: Eased, path: FloatArray, amount: float, enough: float = 0.0) -> tuple[FloatArray, float]:
    """Move a path such that it is free for a smaller amount of easing.

    The first moves are anywhere on the path, later ones near the place that needs the largest amount.

    Args:
        eased: The question made easier by an amount.
        path: A path that is free with ``amount``, circular axes unwrapped, shape (m, 3 + n).
        amount: The amount.
        enough: Amount at which it may stop.

    Returns:
        The path, and the amount with which all its samples are free; this is measured and proves nothing.
    """
    path = densified(path, configuration_scale(eased(amount).tree), SPACING)
    needed, worst = amount_needed(eased, path, amount)
    for number in range(ROUNDS_OF_MOVES):
        if needed <= enough:
            break
        here = slice(max(0, worst - WINDOW), worst + WINDOW + 1) if number else slice(None)
        last = here.stop is None or here.stop >= len(path)
        part = with_larger_least_clearance(eased(needed), path[here], number, free_end=last)
        moved = np.concatenate((path[: here.start or 0], part, path[len(path) if last else here.stop :]))
        less, at = amount_needed(eased, moved, needed)
        if less <= needed:
            path, needed, worst = moved, less, at
    return path, needed


def with_larger_least_clearance(
    problem: PlanningProblem, path: FloatArray, seed: int, *, free_end: bool
) -> FloatArray:
    """Move a free path such that its smallest clearance becomes larger.

    Args:
        problem: The question.
        path: Samples, close together, shape (m, 3 + n).
        seed: Seed of the random moves.
        free_end: Whether the path ends at the goal, where free joints may move.
    """
    tree = problem.tree
    team, scale = tree.arrays, configuration_scale(tree)
    unbounded = np.full(3, np.inf)
    better: FloatArray = improve(
        team,
        grid_for_team(problem.workspace, team),
        np.array(PRICES),
        path,
        np.concatenate((-unbounded, tree.joint_lower)),
        np.concatenate((unbounded, tree.joint_upper)),
        scale,
        scale,
        BODY_GAP,
        free_end and all(value is None for value in problem.goal_joints),
        np.random.default_rng(seed).random((MOVES, 5)),
    )
    return better


def amount_needed(eased: Eased, path: FloatArray, most: float) -> tuple[float, int]:
    """Smallest amount, up to ``most``, with which all samples are free, and the sample that needs it."""
    lower, upper, worst = 0.0, most, 0
    for _ in range(HALVINGS):
        middle = 0.5 * (lower + upper)
        blocked = first_blocked(eased(middle), path)
        if blocked < len(path):
            lower, worst = middle, blocked
        else:
            upper = middle
    return upper, worst


def first_blocked(problem: PlanningProblem, path: FloatArray) -> int:
    """Index of the first sample that is not within limits and free of collisions, m if all are; exact."""
    team, within = problem.tree.arrays, _within_limits(problem, path)
    count = len(path) if within.all() else int(np.argmin(within))
    return first_collision(team, grid_for_team(problem.workspace, team), path[:count], 0.0)


def are_free(problem: PlanningProblem, path: FloatArray) -> NDArray[np.bool_]:
    """Whether each sample is within limits and free of collisions; exact, shape (m,)."""
    team = problem.tree.arrays
    grid = grid_for_team(problem.workspace, team)
    free: NDArray[np.bool_] = np.array([is_free(team, grid, z, 0.0) for z in path])
    return free & _within_limits(problem, path)


def _within_limits(problem: PlanningProblem, path: FloatArray) -> NDArray[np.bool_]:
    """Whether all joints of each sample are within their limits, shape (m,)."""
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    within: NDArray[np.bool_] = np.all((path[:, 3:] >= lower) & (path[:, 3:] <= upper), axis=1)
    return within


def widened_floor(workspace: Polygon, amount: float) -> MultiPolygon:
    """Workspace with all walls moved back by an amount [m]; walls thinner than twice as much disappear."""
    grown = workspace.buffer(amount, join_style="mitre", mitre_limit=MITRE_LIMIT)
    return MultiPolygon(parts_of(grown))


def repaired(problem: PlanningProblem, path: FloatArray, growth: float) -> tuple[FloatArray, float]:
    """Move a path for a larger floor until all its samples are free on the original floor.

    Args:
        problem: The question.
        path: A path on the floor widened by ``growth``, circular axes unwrapped, shape (m, 3 + n).
        growth: How far walls were moved back for it [m].

    Returns:
        The path, and how far walls have to be moved back for all its samples, zero or less where they need
        not [m]. Samples prove nothing: boxes have to cover it.
    """
    eased, needed = _eased(problem), growth + LEAST_CLEARANCE
    for _ in range(REPAIRS):
        before = needed
        path, needed = ease_less(eased, path, needed, enough=SOLVED_FRACTION * LEAST_CLEARANCE)
        if needed <= SOLVED_FRACTION * LEAST_CLEARANCE or needed > PROGRESS_FRACTION * before:
            break
    return path, needed - LEAST_CLEARANCE


def centred(problem: PlanningProblem, path: FloatArray, short: float) -> tuple[FloatArray, float]:
    """Move a path to the middle of its narrowest passages by linear programs.

    Args:
        problem: The question.
        path: A path that is free with walls moved back by ``short``, circular axes unwrapped, shape
            (m, 3 + n).
        short: That distance; negative where they are moved in, by up to ``LEAST_CLEARANCE`` [m].

    Returns:
        The path with samples added, and the distance with which all of them are free.
    """
    eased, scale, amount = _eased(problem), configuration_scale(problem.tree), short + LEAST_CLEARANCE
    for spacing in FINE_SPACINGS:
        path = densified(path, scale, spacing)
        amount, _ = amount_needed(eased, path, amount + CHORD)
        move = LARGEST_MOVE
        while move > SMALLEST_MOVE:
            moved = with_wider_passages(eased(amount), path, move, STRETCH * spacing)
            less, _ = amount_needed(eased, moved, amount)
            if amount - less > LEAST_GAIN:
                path, amount = moved, less
            else:
                move *= SHORTER
        if amount > LEAST_CLEARANCE + CHORD:
            break
    return path, amount - LEAST_CLEARANCE


def _eased(problem: PlanningProblem) -> Eased:
    """The question with walls moved back by an amount less ``LEAST_CLEARANCE``."""

    def eased(amount: float) -> PlanningProblem:
        floor = problem.workspace.buffer(amount - LEAST_CLEARANCE, join_style="mitre")
        return replace(problem, workspace=floor)

    return eased
