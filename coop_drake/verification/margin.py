"""Which walls the cores of a plan keep its margin from."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from shapely import MultiPoint
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.outer_sweeps import outer_sweep
from coop_drake.verification.solids import Solid
from coop_drake.verification.walls import Walls

__all__ = ["walls_to_keep_off"]

CLOSE = 1.1
"""An end of the transport that stands nearer to a wall than so many margins is let off there [-]."""

LET_OFF = 3.5
"""The margin is not promised from walls nearer than so many margins to such an end [-]."""


def walls_to_keep_off(
    problem: PlanningProblem, solids: tuple[Solid, ...], walls: Walls, margin: float
) -> Walls:
    """Leave out the walls beside a start or a goal that has less room than the margin itself.

    Args:
        problem: The question.
        solids: The team.
        walls: All walls.
        margin: The margin [m].
    """
    edges: Any = shapely.linestrings(np.stack((walls.starts, walls.ends), axis=1))
    for end in (_at_start(problem, solids), _at_goal(problem, solids)):
        if float(end.distance(problem.workspace.boundary)) < CLOSE * margin:
            edges = shapely.difference(edges, end.buffer(LET_OFF * margin))
    pieces = shapely.get_coordinates([part for part in shapely.get_parts(edges) if not part.is_empty])
    ends = pieces.reshape(-1, 2, 2)
    return Walls(walls.floor, ends[:, 0], ends[:, 1])


def _at_start(problem: PlanningProblem, solids: tuple[Solid, ...]) -> BaseGeometry:
    return _footprint(solids, problem.start[:2], problem.start[2:])


def _at_goal(problem: PlanningProblem, solids: tuple[Solid, ...]) -> BaseGeometry:
    """What is known of the team at its goal: the object where a joint is free, else all."""
    known = [0.0 if goal is None else goal for goal in problem.goal_joints]
    free = any(goal is None for goal in problem.goal_joints)
    kept = tuple(solid for solid in solids if solid.component == 0) if free else solids
    return _footprint(kept, problem.goal_pose[:2], np.array([problem.goal_pose[2], *known]))


def _footprint(solids: tuple[Solid, ...], position: FloatArray, angles: FloatArray) -> BaseGeometry:
    """What some solids cover at one configuration."""
    rings = [position + outer_sweep(solid, angles, angles, 1.0) for solid in solids]
    shapes = [
        MultiPoint(ring).convex_hull.buffer(solid.radius) for ring, solid in zip(rings, solids, strict=True)
    ]
    return shapely.union_all(shapes)
