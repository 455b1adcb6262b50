"""Which edges of the floor the cores of a plan must keep clear of by the margin."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from shapely import MultiPoint
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.floor_edges import FloorEdges
from coop_drake.verification.outer_sweeps import outer_sweep
from coop_drake.verification.solids import Solid

__all__ = ["edges_to_keep_clear_of"]

CLOSE = 1.1
"""A start or goal nearer to a wall than so many margins cannot keep the margin there [-]."""

EXEMPT = 3.5
"""Walls nearer to such a start or goal than so many margins are exempt: the planner keeps less there [-]."""


def edges_to_keep_clear_of(
    problem: PlanningProblem, solids: tuple[Solid, ...], edges: FloorEdges, margin: float
) -> FloorEdges:
    """Leave out the walls beside a start or a goal that has less clearance than the margin itself.

    Args:
        problem: The problem.
        solids: The team.
        edges: All edges.
        margin: The margin [m].
    """
    # Of the team at its goal only the object is known where a joint is free.
    joints = [0.0 if goal is None else goal for goal in problem.goal_joints]
    known = tuple(solid for solid in solids if solid.component == 0 or None not in problem.goal_joints)
    start = _footprint(solids, problem.start[:2], problem.start[2:])
    goal = _footprint(known, problem.goal_pose[:2], np.array([problem.goal_pose[2], *joints]))
    lines: Any = shapely.linestrings(np.stack((edges.starts, edges.ends), axis=1))
    for end in (start, goal):
        if float(end.distance(problem.workspace.boundary)) < CLOSE * margin:
            lines = shapely.difference(lines, end.buffer(EXEMPT * margin))
    pieces = shapely.get_coordinates([part for part in shapely.get_parts(lines) if not part.is_empty])
    ends = pieces.reshape(-1, 2, 2)
    return FloorEdges(edges.floor, ends[:, 0], ends[:, 1])


def _footprint(solids: tuple[Solid, ...], position: FloatArray, angles: FloatArray) -> BaseGeometry:
    """What some solids cover in W at one configuration."""
    rings = [position + outer_sweep(solid, angles, angles, 1.0) for solid in solids]
    shapes = [
        MultiPoint(ring).convex_hull.buffer(solid.radius) for ring, solid in zip(rings, solids, strict=True)
    ]
    return shapely.union_all(shapes)
