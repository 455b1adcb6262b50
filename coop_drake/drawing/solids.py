"""Solids, cameras and the player of scenes in Meshcat, and footprints of bodies; needs no matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from math import cos, radians, sin, tan

import numpy as np
import shapely
from manifold3d import CrossSection
from numpy.typing import NDArray
from shapely import MultiPoint, Polygon, constrained_delaunay_triangles, union_all
from shapely.geometry.base import BaseGeometry

from coop_drake.drawing import colours
from coop_drake.geometry.polygons import parts_of
from coop_drake.templates import rendered
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree

# Where to stand to see the whole floor.

_ASPECT = 4 / 3  # Browser windows are seldom narrower than this.


def camera_pose(
    workspace: Polygon,
    height: float,
    *,
    elevation: float = radians(62.0),
    turn: float = 0.0,
    fill: float = 0.92,
    field_of_view: float = radians(75.0),
) -> tuple[FloatArray, FloatArray]:
    """Return the camera's position and its target, from which the workspace just fills the picture.

    Args:
        workspace: The floor [m].
        height: Height up to which things stand on it [m].
        elevation: How steeply the camera looks down [rad].
        turn: How far round it stands, counter-clockwise, from where it looks along +y [rad].
        fill: Part of the picture that the floor and what stands on it may fill.
        field_of_view: Of the camera, from bottom to top [rad]; Meshcat's own if not given.

    Returns:
        Position and target, each of shape (3,), in W [m].
    """
    half_height = tan(field_of_view / 2)
    half_width = half_height * _ASPECT
    outline = shapely.get_coordinates(workspace.convex_hull)[:-1]
    corners = np.array([[x, y, z] for x, y in outline for z in (0.0, height)])
    right = np.array([cos(turn), sin(turn), 0.0])
    ahead = np.array([-sin(turn), cos(turn), 0.0])
    up = sin(elevation) * ahead + [0.0, 0.0, cos(elevation)]
    away = np.cross(right, up)
    x_min, y_min, x_max, y_max = workspace.bounds
    target = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max), 0.0])
    distance = (x_max - x_min + y_max - y_min) / half_height
    for _ in range(40):
        offsets = corners - target
        depth = distance - offsets @ away
        vertical = offsets @ up / depth / half_height
        horizontal = offsets @ right / depth / half_width
        rise, drift = (0.5 * float(seen.max() + seen.min()) for seen in (vertical, horizontal))
        target += 0.5 * rise * half_height * distance / sin(elevation) * ahead
        target += 0.5 * drift * half_width * distance * right
        extent = max(vertical.max() - rise, horizontal.max() - drift)
        distance *= (extent / fill) ** 0.5
    return target + distance * away, target


# The style sheet of pages that play a scene: headline above, key of colours and player below.


def player_style() -> str:
    """Return the style sheet, in the colours of all pictures."""
    return rendered("coop_drake.drawing", "player.css", colours=colours)


# Triangle meshes of shapes that lie flat or stand up, of lines on the floor, and of tubes.

_TUBE_CORNERS = 6
"""Corners of a tube's cross-section: it looks round where it is a few pixels wide."""


@dataclass(frozen=True)
class TriangleMesh:
    """A triangle mesh.

    Attributes:
        vertices: Shape (v, 3) [m].
        faces: Indices of vertices, shape (f, 3).
    """

    vertices: FloatArray
    faces: NDArray[np.int32]


def wall_polygons(workspace: Polygon, thickness: float) -> list[Polygon]:
    """Return what stands on the floor: a rim of the given thickness [m] around it, and every hole filled.

    Where the rims at both sides of a wall leave a gap of less than two thicknesses, the wall is one piece.
    """
    outer = Polygon(workspace.exterior)
    around = outer.buffer(2.0 * thickness, join_style="mitre", mitre_limit=2.0)
    rim = around.buffer(-thickness, join_style="mitre", mitre_limit=2.0).difference(outer)
    return parts_of(rim) + [Polygon(hole) for hole in workspace.interiors]


def flat_mesh(shapes: Iterable[Polygon], height: float) -> TriangleMesh:
    """Return the shapes triangulated at one height [m]."""
    return _mesh(np.concatenate([_triangles(shape, height) for shape in shapes]))


def slab_mesh(shapes: Iterable[Polygon], bottom: float, top: float) -> TriangleMesh:
    """Return the shapes extruded from one height to another [m]: their sides and tops."""
    pieces: list[FloatArray] = []
    for shape in shapes:
        pieces.append(_triangles(shape, top))
        rings = (shape.exterior, *shape.interiors)
        pieces.extend(_sides(np.asarray(ring.coords)[:, :2], bottom, top) for ring in rings)
    return _mesh(np.concatenate(pieces))


def extruded_section(section: CrossSection, bottom: float, top: float, tolerance: float) -> TriangleMesh:
    """Return a section of many parts, not empty, extruded from one height to another.

    Its outline may move by the tolerance [m] when it is simplified.
    """
    simpler = section.simplify(tolerance)
    solid = (section if simpler.is_empty() else simpler).extrude(top - bottom).translate((0.0, 0.0, bottom))
    mesh = solid.to_mesh()
    vertices = np.asarray(mesh.vert_properties, dtype=float)[:, :3]
    return TriangleMesh(vertices, np.asarray(mesh.tri_verts, dtype=np.int32))


def ribbon_mesh(points: FloatArray, width: float, height: float) -> TriangleMesh:
    """Return a ribbon along a line on the floor, two triangles a piece, in the order of the line.

    The line has two points or more, shape (P, 2) [m]; width of the ribbon and height above the floor [m].
    """
    along = np.gradient(points, axis=0)
    lengths = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    aside = 0.5 * width * np.column_stack([-along[:, 1], along[:, 0]]) / lengths
    edges = np.stack([points + aside, points - aside], axis=1).reshape(-1, 2)
    first = 2 * np.arange(len(points) - 1)
    faces = np.stack([first, first + 1, first + 3, first, first + 3, first + 2], axis=1).reshape(-1, 3)
    return TriangleMesh(np.column_stack([edges, np.full(len(edges), height)]), faces.astype(np.int32))


def tube_mesh(points: FloatArray, radius: float) -> TriangleMesh:
    """Return straight pieces of tube from point to point, shape (P, 3); NaN interrupts the tube."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    pieces = zip(pairwise(points), lengths, strict=True)
    return joined(_tube_piece(a, b, radius) for (a, b), length in pieces if length > 1e-9)


def joined(meshes: Iterable[TriangleMesh]) -> TriangleMesh:
    """Return several meshes as one; an empty one of none."""
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int32)], 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + np.int32(count))
        count += len(mesh.vertices)
    return TriangleMesh(np.concatenate(vertices), np.concatenate(faces))


def ring_lines(shapes: Iterable[Polygon], height: float) -> tuple[FloatArray, FloatArray]:
    """Return start and end points of every edge of the shapes at one height, each of shape (3, m) [m]."""
    starts, ends = [], []
    for shape in shapes:
        for ring in (shape.exterior, *shape.interiors):
            points = np.asarray(ring.coords)[:, :2]
            points = np.column_stack([points, np.full(len(points), height)])
            starts.append(points[:-1])
            ends.append(points[1:])
    return np.vstack(starts).T.copy(order="F"), np.vstack(ends).T.copy(order="F")


def _triangles(shape: Polygon, height: float) -> FloatArray:
    """Return the corners of triangles that tile the shape, shape (f, 3, 3)."""
    tiles = [
        np.asarray(tile.exterior.coords)[:3, :2] for tile in parts_of(constrained_delaunay_triangles(shape))
    ]
    corners = np.array(tiles).reshape(-1, 3, 2)
    return np.concatenate([corners, np.full((len(corners), 3, 1), height)], axis=2)


def _sides(ring: FloatArray, bottom: float, top: float) -> FloatArray:
    """Return the corners of two triangles for every edge of a closed ring, shape (2 m, 3, 3)."""
    low = np.column_stack([ring, np.full(len(ring), bottom)])
    high = np.column_stack([ring, np.full(len(ring), top)])
    first = np.stack([low[:-1], low[1:], high[1:]], axis=1)
    second = np.stack([low[:-1], high[1:], high[:-1]], axis=1)
    return np.concatenate([first, second])


def _tube_piece(a: FloatArray, b: FloatArray, radius: float) -> TriangleMesh:
    """Return a straight tube from a to b, each of shape (3,), a little longer so that bends have no notch."""
    along = (b - a) / np.linalg.norm(b - a)
    across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
    across /= np.linalg.norm(across)
    turns = np.arange(_TUBE_CORNERS) * (2.0 * np.pi / _TUBE_CORNERS)
    ring = radius * (np.outer(np.cos(turns), across) + np.outer(np.sin(turns), np.cross(along, across)))
    i = np.arange(_TUBE_CORNERS)
    j = (i + 1) % _TUBE_CORNERS
    first = np.column_stack([i, j, j + _TUBE_CORNERS])
    second = np.column_stack([i, j + _TUBE_CORNERS, i + _TUBE_CORNERS])
    reach = 0.5 * radius * along
    vertices = np.concatenate([a - reach + ring, b + reach + ring])
    return TriangleMesh(vertices, np.concatenate([first, second]).astype(np.int32))


def _mesh(corners: FloatArray) -> TriangleMesh:
    """Return the mesh of triangles of shape (f, 3, 3); corners that several share are kept once."""
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return TriangleMesh(vertices, faces.reshape(-1, 3).astype(np.int32))


# Footprints of the team on the floor at one configuration.


@dataclass(frozen=True)
class BodyFootprint:
    """Where one body stands.

    Attributes:
        name: Scoped name of the body.
        robot: Index of its robot, None for the object.
        shape: Its projection to the floor, in W [m].
    """

    name: str
    robot: int | None
    shape: BaseGeometry


def team_footprints(tree: ComponentTree, configuration: FloatArray) -> list[BodyFootprint]:
    """Return the footprint of every body at z = (x, y, theta, q...), shape (3 + n,), the object's first."""
    footprints = []
    for component, X_WC in zip(tree.components, tree.poses(configuration), strict=True):
        for body in component.bodies:
            hulls = [
                MultiPoint(X_WC.apply(np.atleast_2d(shape.vertices))).convex_hull.buffer(shape.radius)
                for shape in body.shapes
            ]
            footprints.append(BodyFootprint(body.name, body.robot, union_all(hulls)))
    return sorted(footprints, key=lambda footprint: footprint.robot is not None)
