"""A check of another planner's path, at far more configurations, with shapely and with the compiled check."""

from __future__ import annotations

from itertools import pairwise
from math import pi, remainder

import numpy as np
import shapely

from coop_drake.answers import PlanningProblem
from coop_drake.planning.sampling.collision import grid_for_team, is_free
from coop_drake.tree.component_tree import ConvexShape
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

__all__ = ["fault_of"]

_DENSE = 0.002
"""Distance between the compiled checks [m]."""
_EXACT = 0.05
"""Distance between shapely's checks [m]."""
_ARRIVED = 1e-6
"""A path that ends this close to the goal has arrived [m, rad]: it absorbs rounding."""


def fault_of(problem: PlanningProblem, path: FloatArray) -> str:
    """Say what is wrong with a path; an empty string if it is valid.

    It must begin at the start and end at the goal, modulo whole turns, keep the joints' limits, and no
    configuration on the straight segments between its own may touch a wall or bring two bodies together.

    Args:
        problem: The question.
        path: Configurations, theta unwrapped, shape (m, 3 + n).
    """
    if not _same(problem, path[0], problem.start):
        return "it does not begin at the start"
    goal = [
        value if asked is None else asked
        for value, asked in zip(path[-1], (*problem.goal_pose, *problem.goal_joints), strict=True)
    ]
    if not _same(problem, path[-1], np.array(goal)):
        return "it does not end at the goal"
    joints, tree = path[:, 3:], problem.tree
    if (joints < tree.joint_lower - _ARRIVED).any() or (joints > tree.joint_upper + _ARRIVED).any():
        return "a joint leaves its range"
    team = tree.arrays
    grid = grid_for_team(problem.workspace, team)
    scale = configuration_scale(tree)
    for z in _densified(path, scale, _DENSE):
        if not is_free(team, grid, z, 0.0):
            return f"it collides at {np.round(z, 4).tolist()}"
    return _exact_fault(problem, _densified(path, scale, _EXACT))


def _same(problem: PlanningProblem, first: FloatArray, second: FloatArray) -> bool:
    turns = zip(first - second, (False, False, *problem.tree.circular), strict=True)
    away = [abs(remainder(off, 2.0 * pi)) if circular else abs(off) for off, circular in turns]
    return max(away) <= _ARRIVED


def _densified(path: FloatArray, scale: FloatArray, step: float) -> FloatArray:
    """Configurations along a path between which no point of the team moves further than a step."""
    parts = [path[:1]]
    for first, last in pairwise(path):
        count = max(1, int(np.ceil((np.abs(last - first) * scale).sum() / step)))
        parts.append(first + (last - first) * (np.arange(1, count + 1) / count)[:, None])
    return np.concatenate(parts)


def _exact_fault(problem: PlanningProblem, path: FloatArray) -> str:
    """Faults that shapely finds: pieces outside the floor, or pieces of two bodies that intersect."""
    tree, floor = problem.tree, problem.workspace
    shapely.prepare(floor)
    edge = floor.boundary
    poses = [np.array([[p.x, p.y, p.angle] for p in tree.poses(z)]) for z in path]
    placed = np.array(poses)
    pieces: dict[tuple[int, int], list[tuple[np.ndarray, float]]] = {}
    for c, component in enumerate(tree.components):
        for b, body in enumerate(component.bodies):
            pieces[c, b] = [(_moved(shape, placed[:, c]), shape.radius) for shape in body.shapes]
    for (c, b), shapes in pieces.items():
        for outline, radius in shapes:
            inside = shapely.covers(floor, outline)
            if radius > 0.0:
                inside &= shapely.distance(edge, outline) >= radius
            if not inside.all():
                return f"{tree.components[c].bodies[b].name} leaves the floor"
    for first, second in tree.collision_pairs:
        for outline, radius in pieces[first]:
            for other, growth in pieces[second]:
                if (shapely.distance(outline, other) <= radius + growth).any():
                    names = [tree.components[c].bodies[b].name for c, b in (first, second)]
                    return f"{names[0]} and {names[1]} meet"
    return ""


def _moved(shape: ConvexShape, poses: FloatArray) -> np.ndarray:
    """A piece without its growth at poses (x, y, angle), shape (m, 3): m points, segments or polygons."""
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([np.stack([cosine, -sine], -1), np.stack([sine, cosine], -1)], -2)
    corners = np.einsum("mij,vj->mvi", turn, shape.vertices) + poses[:, None, :2]
    if corners.shape[1] == 1:
        return np.asarray(shapely.points(corners[:, 0]))
    return np.asarray(shapely.linestrings(corners) if corners.shape[1] == 2 else shapely.polygons(corners))
