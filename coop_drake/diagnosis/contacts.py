"""Collisions at one configuration: bodies that leave the floor, bodies that overlap."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.drawing import BodyFootprint, team_footprints
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray

NEGLIGIBLE = 1e-4
"""Less deep than this is no collision: arcs are polygons here [m]."""

ROUNDING = 1e-9
"""A corner of a wall this near to a part of a body is inside it [m]."""

Depth = tuple[float, FloatArray, FloatArray]


@dataclass(frozen=True)
class Contact:
    """One body that leaves the floor on one side.

    Attributes:
        body: Its name.
        robot: Its robot, None for the object.
        depth: How far [m].
        point: Its point that is farthest out, shape (2,) [m].
        wall: Point of the wall nearest to that, shape (2,) [m].
    """

    body: str
    robot: int | None
    depth: float
    point: FloatArray
    wall: FloatArray


@dataclass(frozen=True)
class Overlap:
    """Two bodies that overlap.

    Attributes:
        bodies: Their names.
        depth: How far one would have to move to leave the other, convex piece by convex piece [m].
    """

    bodies: tuple[str, str]
    depth: float


def contacts(workspace: Polygon, tree: ComponentTree, configuration: FloatArray) -> list[Contact]:
    """Bodies that leave the floor W at z, shape (3 + n,), one entry for each side, the deepest first."""
    found = []
    shapely.prepare(workspace)
    for footprint in team_footprints(tree, configuration):
        if not workspace.covers(footprint.shape):
            found += _outside(workspace, footprint)
    return sorted(found, key=lambda contact: (-contact.depth, contact.body))


def deepest(workspace: Polygon, tree: ComponentTree, configuration: FloatArray) -> float:
    """How far the bodies leave the floor at most, 0 if none does [m]; arguments as above."""
    found = contacts(workspace, tree, configuration)
    return found[0].depth if found else 0.0


def _outside(workspace: Polygon, footprint: BodyFootprint) -> list[Contact]:
    """One contact for every part of a body outside the floor, measured where it is deepest."""
    found = []
    for part in shapely.get_parts(shapely.difference(footprint.shape, workspace)):
        depth, point, wall = max(
            [_farthest_corner(workspace, part), *_wall_corners(workspace, footprint, part)],
            key=lambda entry: entry[0],
        )
        if depth > NEGLIGIBLE:
            found.append(Contact(footprint.name, footprint.robot, depth, point, wall))
    return found


def _farthest_corner(workspace: Polygon, part: BaseGeometry) -> Depth:
    """The corner of a part that is farthest from the floor, and the point of the wall nearest to it."""
    corners = shapely.get_coordinates(part)
    depths = [workspace.distance(Point(corner)) for corner in corners]
    worst = depths.index(max(depths))
    ends = shapely.get_coordinates(shapely.shortest_line(Point(corners[worst]), workspace.boundary))
    return depths[worst], ends[0], ends[-1]


def _wall_corners(workspace: Polygon, footprint: BodyFootprint, part: BaseGeometry) -> list[Depth]:
    """Corners of the walls inside a body: how far each is from the body's outline, and where."""
    near = part.buffer(ROUNDING)
    entries = []
    for corner in shapely.get_coordinates(workspace):
        place = Point(corner)
        if near.contains(place) and footprint.shape.contains(place):
            ends = shapely.get_coordinates(shapely.shortest_line(place, part.boundary.difference(workspace)))
            if len(ends):
                entries.append((float(np.hypot(*(ends[-1] - corner))), ends[-1], corner))
    return entries


def overlaps(tree: ComponentTree, configuration: FloatArray) -> list[Overlap]:
    """Pairs of bodies that overlap at z, shape (3 + n,), but must not, the deepest first."""
    poses = tree.poses(configuration)
    found = []
    for (i, j), (k, m) in tree.collision_pairs:
        first, second = tree.components[i].bodies[j], tree.components[k].bodies[m]
        depth = max(
            (
                _depth(poses[i].apply(a.vertices), a.radius, poses[k].apply(b.vertices), b.radius)
                for a, b in product(first.shapes, second.shapes)
            ),
            default=0.0,
        )
        if depth > NEGLIGIBLE:
            found.append(Overlap((first.name, second.name), depth))
    return sorted(found, key=lambda overlap: (-overlap.depth, overlap.bodies))


def _depth(a: FloatArray, grown_a: float, b: FloatArray, grown_b: float) -> float:
    """Depth of the overlap of two grown convex polygons: the origin's depth in their Minkowski difference."""
    hull = shapely.MultiPoint((a[:, None, :] - b[None, :, :]).reshape(-1, 2)).convex_hull
    origin, grown = Point(0.0, 0.0), grown_a + grown_b
    if isinstance(hull, Polygon) and hull.covers(origin):
        return grown + float(hull.exterior.distance(origin))
    return max(0.0, grown - float(hull.distance(origin)))
