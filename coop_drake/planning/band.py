"""Straighten a candidate path and draw it away from the walls, so that long boxes fit around it."""

from __future__ import annotations

import numpy as np

from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.tree import ComponentTree
from coop_drake.planning.band_kernels import improve
from coop_drake.planning.margins import marginal_workspace
from coop_drake.planning.problem import PlanningProblem
from coop_drake.planning.refine import configuration_scale
from coop_drake.planning.sampler import densified
from coop_drake.planning.team_arrays import team_arrays
from coop_drake.planning.walls import FAR, walls_for

_LEAST_ROOM = 0.005
_SPEED, _TURN_RATE, _JOINT_RATE = 1.2, 0.5, 0.6
"""Speeds of position, theta and joints with which transports go at their best [m/s, rad/s]."""

_PRICE = 0.12
"""Price per length of the path, times the clearance there [m]."""


def drawn_tight(
    problem: PlanningProblem,
    path: FloatArray,
    clearance: float,
    margin: float,
    gap: float,
    spacing: float = 0.05,
    moves: int = 4_000,
) -> FloatArray:
    """Improve a path; start and goal stay, joints that are free at the goal may end elsewhere.

    Args:
        problem: The question.
        path: Configurations that keep the clearance, theta unwrapped, shape (m, 3 + n).
        clearance: Distance from the walls that the path keeps and will keep [m].
        margin: Margin that the boxes must keep; clearance above it is what they can use [m].
        gap: Distance that pairs of bodies keep [m].
        spacing: Distance between samples of the path in any scaled axis [m].
        moves: Changes that are tried.
    """
    tree = problem.tree
    scale = configuration_scale(tree)
    team = team_arrays(tree)
    walls = walls_for(marginal_workspace(problem, clearance), team)
    unbounded = np.full(3, np.inf)
    better: FloatArray = improve(
        team,
        walls,
        np.array([_PRICE * spacing, max(clearance - margin, 0.0) + _LEAST_ROOM, FAR]),
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


def hurried_time(path: FloatArray) -> float:
    """Least time that a path may take, walls aside: the slowest of position, theta and joints in turn [s].

    Args:
        path: Configurations, theta unwrapped, shape (m, 3 + n).
    """
    moved = np.abs(np.diff(path, axis=0))
    times = np.column_stack(
        (np.hypot(moved[:, 0], moved[:, 1]) / _SPEED, moved[:, 2] / _TURN_RATE, moved[:, 3:] / _JOINT_RATE)
    )
    return float(times.max(axis=1).sum())


def _speeds(tree: ComponentTree) -> FloatArray:
    """Speeds of all axes of z at their best, shape (3 + n,)."""
    return np.array([_SPEED, _SPEED, _TURN_RATE, *[_JOINT_RATE] * len(tree.joints)])
