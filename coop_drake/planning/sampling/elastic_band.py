"""Straighten a candidate path and draw it away from the walls, so that long boxes fit around it."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.margins import marginal_workspace
from coop_drake.planning.sampling.elastic_band_kernels import clearances, improve
from coop_drake.planning.sampling.obstacle_grid import FAR, walls_for
from coop_drake.planning.sampling.sampler import JOINT_RATE, SPEED, TURN_RATE, densified
from coop_drake.planning.sampling.team_arrays import team_arrays
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

__all__ = ["PRICE", "drawn_tight", "likely_time", "room_along"]

PRICE = 0.12
"""Price per length of the path, times the clearance there [m]."""

LEAST_ROOM = 0.005
"""Clearance that is added to what a path has before it is priced [m]."""

SPACING = 0.1
"""Distance between samples of a path in any scaled axis, where nothing else is said [m]."""

SLOWNESS, SOME_ROOM = 0.25, 0.02
"""What narrowness costs candidates: time per length, times clearance and some room [s], [m]."""

NEAR_END = 2.0
"""Over so many clearances from the start or the goal there may be less room: where they stand close to a
wall themselves [-]."""


def drawn_tight(
    problem: PlanningProblem,
    path: FloatArray,
    clearance: float,
    margin: float,
    gap: float,
    spacing: float = SPACING,
    moves: int = 4_000,
    price: float = PRICE,
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
        price: What a length of the path costs, times the clearance there: the more, the wider it runs [m].
    """
    tree = problem.tree
    scale = configuration_scale(tree)
    team = team_arrays(tree)
    walls = walls_for(marginal_workspace(problem, clearance), team)
    unbounded = np.full(3, np.inf)
    better: FloatArray = improve(
        team,
        walls,
        np.array([price * spacing, max(clearance - margin, 0.0) + LEAST_ROOM, FAR]),
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


def likely_time(problem: PlanningProblem, path: FloatArray) -> float:
    """About how long a transport along a path takes, to tell candidates apart: the less room, the slower [s].

    Args:
        problem: The question.
        path: Configurations, theta unwrapped, shape (m, 3 + n).
    """
    scale, team = configuration_scale(problem.tree), team_arrays(problem.tree)
    samples = densified(path, scale, SPACING)
    rooms = np.maximum(clearances(team, walls_for(problem.workspace, team), samples, FAR), 0.0)
    moved = np.abs(np.diff(samples, axis=0))
    shifted = np.hypot(moved[:, 0], moved[:, 1])
    hurried = np.maximum(shifted / SPEED, (moved[:, 2:] / _speeds(problem.tree)[2:]).max(axis=1))
    swept = shifted + 0.5 * (moved[:, 2:] * scale[2:]).max(axis=1)
    return float((hurried + SLOWNESS * swept / (np.minimum(rooms[1:], rooms[:-1]) + SOME_ROOM)).sum())


def room_along(problem: PlanningProblem, path: FloatArray, most: float) -> float:
    """Clearance of a path's samples, but for those near an end where the end itself has less.

    Args:
        problem: The question.
        path: Configurations, theta unwrapped, shape (m, 3 + n).
        most: Clearances above this one do not matter [m].

    Returns:
        The clearance; a measure of samples, and no proof [m].
    """
    scale, team = configuration_scale(problem.tree), team_arrays(problem.tree)
    samples = densified(path, scale, 0.5 * SPACING)
    rooms = clearances(team, walls_for(problem.workspace, team), samples, FAR)
    moved = [(np.abs(samples - samples[end]) * scale).sum(axis=1) for end in (0, -1)]
    excused = np.minimum(*moved) / NEAR_END
    room = most
    while True:
        short = rooms[(rooms < room) & (excused > room)]
        if not len(short):
            return max(room, 0.0)
        room = float(short.min())


def _speeds(tree: ComponentTree) -> FloatArray:
    """Speeds of all axes of z at their best, shape (3 + n,)."""
    return np.array([SPEED, SPEED, TURN_RATE, *[JOINT_RATE] * len(tree.joints)])
