"""Elastic-band smoothing: a path becomes shorter and moves away from the walls, so that long boxes fit."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.margins import marginal_workspace
from coop_drake.planning.sampling.densify import densified
from coop_drake.planning.sampling.elastic_band_kernels import clearances, improve
from coop_drake.planning.sampling.obstacle_grid import FAR, grid_for_team
from coop_drake.planning.sampling.sampler import JOINT_RATE, SPEED, TURN_RATE
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

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
    tree = problem.tree
    scale = configuration_scale(tree)
    team = tree.arrays
    grid = grid_for_team(marginal_workspace(problem, clearance), team)
    unbounded = np.full(3, np.inf)
    better: FloatArray = improve(
        team,
        grid,
        np.array([price * spacing, max(clearance - margin, 0.0) + CLEARANCE_OFFSET, FAR]),
        densified(path, scale, spacing),
        np.concatenate((-unbounded, tree.joint_lower)),
        np.concatenate((unbounded, tree.joint_upper)),
        scale,
        _speeds(tree)[0] / _speeds(tree),
        gap,
        all(value is None for value in problem.goal_joints),
        np.random.default_rng(0).random((moves, 5)),
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
