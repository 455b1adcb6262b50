"""Workspaces shrunk by a margin, with room left at the start and at the goal (rule 1)."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.geometry import safeguards
from coop_drake.geometry.convex import normals
from coop_drake.geometry.minkowski import FreeSpace, polygon_rings, to_polygon
from coop_drake.tree.component_tree import Component, ComponentTree
from coop_drake.tree.pose import FloatArray

SMALLEST_MARGIN = 0.005
"""Below this a margin is not worth an attempt of its own [m]."""

_OCTAGON = normals(np.arange(0.5, 8.0, dtype=np.float64) * (pi / 4.0)) / np.cos(pi / 8.0)
_SHARE = 0.2
_CLOSE = 1.1
_NEXT_SHARE = 0.7


def margins(first: float) -> Iterator[float]:
    """The margins to try: the first, then seven tenths of each while worth it [m]."""
    margin = first
    while margin >= SMALLEST_MARGIN:
        yield margin
        margin *= _NEXT_SHARE


def shrunk(workspace: Polygon, margin: float) -> MultiPolygon:
    """Workspace without its points nearer than the margin to a wall, corners by an octagon about the disc.

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


def marginal_workspace(problem: PlanningProblem, margin: float) -> MultiPolygon:
    """Workspace shrunk by the margin except where start or goal themselves stand closer to a wall.

    There a patch around the footprint is shrunk by a fifth of the footprint's own clearance only, so that a
    start near a wall does not forbid a margin everywhere else.
    """
    result = shrunk(problem.workspace, margin)
    for footprint, clearance in _close_ends(problem, margin):
        own = shrunk(problem.workspace, _SHARE * clearance)
        patch = own.intersection(footprint.buffer(2.0 * margin, quad_segs=2))
        result = _areas(shapely.union(result, patch))
    return result


def is_patched(problem: PlanningProblem, margin: float) -> bool:
    """Whether start or goal stand closer to a wall than a margin allows, so that they get a patch."""
    return bool(_close_ends(problem, margin))


def _close_ends(problem: PlanningProblem, margin: float) -> list[tuple[BaseGeometry, float]]:
    """Footprints at start and goal that stand closer to a wall than a margin allows, and how close [m]."""
    boundary = problem.workspace.boundary
    close = []
    for configuration, components in _ends(problem):
        pieces, radii = _pieces(problem.tree, configuration, components)
        # No end is farther from the walls than its pieces: most questions end here.
        if (shapely.distance(boundary, pieces) - radii).min() >= _CLOSE * margin:
            continue
        footprint = exact_footprint(problem.tree, configuration, components)
        clearance = float(boundary.distance(footprint))
        if clearance < _CLOSE * margin and problem.workspace.contains(footprint):
            close.append((footprint, clearance))
    return close


def _ends(problem: PlanningProblem) -> list[tuple[FloatArray, int | None]]:
    """Configurations at start and goal, and how many components are known there.

    At the goal that is all of them if every joint has a goal, else the object's alone.
    """
    joints = [0.0 if value is None else value for value in problem.goal_joints]
    free = any(value is None for value in problem.goal_joints)
    goal = np.array([*problem.goal_pose, *joints])
    return [(problem.start, None), (goal, 1 if free else None)]


def _areas(shape: BaseGeometry) -> MultiPolygon:
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, Polygon)]
    return MultiPolygon(parts)


def exact_footprint(
    tree: ComponentTree, configuration: FloatArray, components: int | None = None
) -> BaseGeometry:
    """Footprint of the first components at a configuration, eq. (3), discs by fine polygons.

    Args:
        tree: The team.
        configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        components: How many components to take; None for all.
    """
    pieces, radii = _pieces(tree, configuration, components)
    return shapely.union_all(shapely.buffer(pieces, radii, quad_segs=32))


def _pieces(
    tree: ComponentTree, configuration: FloatArray, components: int | None
) -> tuple[list[BaseGeometry], FloatArray]:
    """Hulls of the pieces of the first components at a configuration, and by how much they are grown [m]."""
    chosen: list[Component] = list(tree.components[:components])
    placed = [
        (shapely.MultiPoint(X_WC.apply(shape.vertices)).convex_hull, shape.radius)
        for component, X_WC in zip(chosen, tree.poses(configuration), strict=False)
        for body in component.bodies
        for shape in body.shapes
    ]
    return [hull for hull, _ in placed], np.array([radius for _, radius in placed])
