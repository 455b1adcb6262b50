"""Triangle meshes of polygons lying flat or standing up, for Meshcat."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon, constrained_delaunay_triangles
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.pose import FloatArray

__all__ = [
    "TriangleMesh",
    "flat_mesh",
    "joined",
    "parts_of",
    "ribbon_mesh",
    "ring_lines",
    "slab_mesh",
    "wall_mesh",
    "wall_polygons",
]


@dataclass(frozen=True)
class TriangleMesh:
    """A triangle mesh in the layout that Meshcat takes.

    Attributes:
        vertices: Shape (3, v) [m].
        faces: Vertex indices, shape (3, f).
    """

    vertices: FloatArray
    faces: NDArray[np.int32]


def parts_of(shape: BaseGeometry) -> list[Polygon]:
    """Return the polygons a shape consists of; lines and points are dropped."""
    parts = getattr(shape, "geoms", [shape])
    return [part for part in parts if isinstance(part, Polygon) and not part.is_empty]


def wall_polygons(workspace: Polygon, thickness: float) -> list[Polygon]:
    """Return what stands: a rim of the given thickness [m] around the floor, and every hole filled."""
    outer = Polygon(workspace.exterior)
    rim = outer.buffer(thickness, join_style="mitre", mitre_limit=2.0).difference(outer)
    return parts_of(rim) + [Polygon(hole) for hole in workspace.interiors]


def flat_mesh(shapes: Iterable[Polygon], height: float) -> TriangleMesh:
    """Return the shapes triangulated at one height [m]."""
    corners = [_triangles(shape, height) for shape in shapes]
    return _mesh(np.concatenate(corners))


def wall_mesh(shapes: Iterable[Polygon], height: float) -> TriangleMesh:
    """Return the shapes extruded from the floor to ``height`` [m]: their sides and tops."""
    return slab_mesh(shapes, 0.0, height)


def slab_mesh(shapes: Iterable[Polygon], bottom: float, top: float) -> TriangleMesh:
    """Return the shapes extruded from one height to another [m]: their sides and tops."""
    pieces: list[FloatArray] = []
    for shape in shapes:
        pieces.append(_triangles(shape, top))
        rings = (shape.exterior, *shape.interiors)
        pieces.extend(_sides(np.asarray(ring.coords)[:, :2], bottom, top) for ring in rings)
    return _mesh(np.concatenate(pieces))


def ribbon_mesh(points: FloatArray, width: float, height: float) -> TriangleMesh:
    """Return a ribbon along a line on the floor, two triangles a piece, in the order of the line.

    Args:
        points: Shape (P, 2) [m]; at least two.
        width: Of the ribbon [m].
        height: Above the floor [m].
    """
    along = np.gradient(points, axis=0)
    lengths = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    aside = 0.5 * width * np.column_stack([-along[:, 1], along[:, 0]]) / lengths
    edges = np.stack([points + aside, points - aside], axis=1).reshape(-1, 2)
    vertices = np.column_stack([edges, np.full(len(edges), height)]).T
    first = 2 * np.arange(len(points) - 1)
    faces = np.stack([first, first + 1, first + 3, first, first + 3, first + 2], axis=1).reshape(-1, 3).T
    return TriangleMesh(np.asfortranarray(vertices), np.asfortranarray(faces.astype(np.int32)))


def joined(meshes: Iterable[TriangleMesh]) -> TriangleMesh:
    """Return several meshes as one."""
    vertices, faces, count = [], [], 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + np.int32(count))
        count += mesh.vertices.shape[1]
    return TriangleMesh(np.asfortranarray(np.hstack(vertices)), np.asfortranarray(np.hstack(faces)))


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
    """Corners of triangles that tile the shape, shape (f, 3, 3)."""
    tiles = [
        np.asarray(tile.exterior.coords)[:3, :2] for tile in parts_of(constrained_delaunay_triangles(shape))
    ]
    corners = np.array(tiles).reshape(-1, 3, 2)
    return np.concatenate([corners, np.full((len(corners), 3, 1), height)], axis=2)


def _sides(ring: FloatArray, bottom: float, top: float) -> FloatArray:
    """Corners of two triangles for every edge of a closed ring, shape (2 m, 3, 3)."""
    low = np.column_stack([ring, np.full(len(ring), bottom)])
    high = np.column_stack([ring, np.full(len(ring), top)])
    first = np.stack([low[:-1], low[1:], high[1:]], axis=1)
    second = np.stack([low[:-1], high[1:], high[:-1]], axis=1)
    return np.concatenate([first, second])


def _mesh(corners: FloatArray) -> TriangleMesh:
    """The mesh of triangles of shape (f, 3, 3), corners that several share kept once."""
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return TriangleMesh(
        np.asfortranarray(vertices.T), np.asfortranarray(faces.reshape(-1, 3).T.astype(np.int32))
    )
