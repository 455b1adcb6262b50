"""Workspaces shrunk by a margin, except near a start or goal that stands close to a wall (rule 1)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from math import pi

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.geometry import safeguards
from coop_drake.geometry.convex import normals
from coop_drake.geometry.minkowski import FreeSpace, to_polygon
from coop_drake.geometry.parts import parts_of, polygon_rings
from coop_drake.tree.component_tree import Component, ComponentTree
from coop_drake.tree.pose import FloatArray

SMALLEST_MARGIN = 0.005
"""Smaller margins are not tried: they are within the accuracy of a real floor [m]."""

_OCTAGON = normals(np.arange(0.5, 8.0, dtype=np.float64) * (pi / 4.0)) / np.cos(pi / 8.0)
"""Corners of a regular octagon about the unit disc, shape (8, 2) [-]."""
END_FRACTION = 0.2
"""Around a start or goal close to a wall the floor is shrunk by this fraction of its own clearance [-]."""

CLOSE_FACTOR = 1.1
"""A start or goal with less clearance than this many margins counts as close to a wall [-]."""

NEXT_FRACTION = 0.7
"""After a margin failed, this fraction of it is tried [-]."""

PATCH_FACTOR = 2.0
"""The floor around a start or goal that is shrunk less reaches this many margins beyond its footprint [-]."""

_REMEMBERED = 4
"""Floors at a margin, and questions with the clearances of their ends, that are remembered [-]."""

ARC_SEGMENTS = 32
"""Segments of a quarter circle in exact footprints: a disc's polygon is right to 3e-4 of its radius."""


def margins(first: float) -> Iterator[float]:
    """The margins to try: the first, then seven tenths of each, down to ``SMALLEST_MARGIN`` [m]."""
    margin = first
    while margin >= SMALLEST_MARGIN:
        yield margin
        margin *= NEXT_FRACTION


def shrunk(workspace: Polygon, margin: float) -> MultiPolygon:
    """Shrink the workspace by the margin.

    The disc is replaced by an octagon around it, so slightly too much is removed.

    Raises:
        GeometryError: If geometry fails.
    """
    if margin <= 0.0:
        return MultiPolygon([workspace])
    section = FreeSpace(polygon_rings(workspace)).minus(disc_polygon(margin))
    parts = safeguards.components(section, over=False)
    if not (parts or section.is_empty()):
        raise GeometryError(f"the floor at a margin of {margin} m cannot be parted")
    return MultiPolygon([to_polygon(part) for part in parts])


def disc_polygon(radius: float) -> FloatArray:
    """Octagon about a disc, shape (8, 2) [m]."""
    octagon: FloatArray = radius * _OCTAGON
    return octagon


@lru_cache(maxsize=_REMEMBERED)
def marginal_workspace(problem: PlanningProblem, margin: float) -> MultiPolygon:
    """Workspace shrunk by the margin, but less near a start or goal that stands close to a wall.

    There the floor around the footprint is shrunk by a fifth of the footprint's own clearance only, so that a
    start near a wall does not forbid a margin everywhere else. The last few are remembered: a search uses
    the same margins again and again.
    """
    result = shrunk(problem.workspace, margin)
    for footprint, clearance in _close_ends(problem, margin):
        own = shrunk(problem.workspace, END_FRACTION * clearance)
        patch = own.intersection(footprint.buffer(PATCH_FACTOR * margin, quad_segs=2))
        result = MultiPolygon(parts_of(shapely.union(result, patch)))
    return result


def is_patched(problem: PlanningProblem, margin: float) -> bool:
    """Whether the floor near the start or goal is shrunk by less than the margin."""
    return bool(_close_ends(problem, margin))


def _close_ends(problem: PlanningProblem, margin: float) -> list[tuple[BaseGeometry, float]]:
    """Footprints at start and goal that are too close to a wall for a margin, and their clearances [m]."""
    close = []
    for (configuration, components), bound in zip(_ends(problem), _end_clearances(problem), strict=True):
        if bound >= CLOSE_FACTOR * margin:
            continue
        footprint = exact_footprint(problem.tree, configuration, components)
        clearance = float(problem.workspace.boundary.distance(footprint))
        if clearance < CLOSE_FACTOR * margin and problem.workspace.contains(footprint):
            close.append((footprint, clearance))
    return close


@lru_cache(maxsize=_REMEMBERED)
def _end_clearances(problem: PlanningProblem) -> list[float]:
    """Clearances of the nearest pieces at start and goal [m]; most questions need no footprints."""
    placed = [_pieces(problem.tree, *end) for end in _ends(problem)]
    boundary = problem.workspace.boundary
    return [float((shapely.distance(boundary, pieces) - radii).min()) for pieces, radii in placed]


def _ends(problem: PlanningProblem) -> list[tuple[FloatArray, int | None]]:
    """Configurations at start and goal, and the number of components whose pose is known there.

    None stands for all. At the goal only the object's pose is known unless every joint has a goal.
    """
    joints = [0.0 if value is None else value for value in problem.goal_joints]
    free = any(value is None for value in problem.goal_joints)
    goal = np.array([*problem.goal_pose, *joints])
    return [(problem.start, None), (goal, 1 if free else None)]


def exact_footprint(
    tree: ComponentTree, configuration: FloatArray, components: int | None = None
) -> BaseGeometry:
    """Footprint of the first components at a configuration, eq. (3), with fine polygons for discs.

    Args:
        tree: The team.
        configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        components: Number of components to take; None for all.
    """
    pieces, radii = _pieces(tree, configuration, components)
    return shapely.union_all(shapely.buffer(pieces, radii, quad_segs=ARC_SEGMENTS))


def _pieces(
    tree: ComponentTree, configuration: FloatArray, components: int | None
) -> tuple[NDArray[np.object_], FloatArray]:
    """Hulls of the pieces of the first components at a configuration, and the radii they are grown by [m]."""
    chosen: list[Component] = list(tree.components[:components])
    placed = [
        (X_WC.apply(shape.vertices), shape.radius)
        for component, X_WC in zip(chosen, tree.poses(configuration), strict=False)
        for body in component.bodies
        for shape in body.shapes
    ]
    owners = np.repeat(np.arange(len(placed)), [len(vertices) for vertices, _ in placed])
    corners = shapely.multipoints(np.concatenate([vertices for vertices, _ in placed]), indices=owners)
    return np.asarray(shapely.convex_hull(corners)), np.array([radius for _, radius in placed])
