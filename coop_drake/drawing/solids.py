"""Triangle meshes of polygons lying flat or standing up, for Meshcat."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon, constrained_delaunay_triangles
from shapely.geometry.base import BaseGeometry

from coop_drake.geometry.pose import FloatArray

__all__ = ["TriangleMesh", "flat_mesh", "parts_of", "ring_lines", "wall_mesh", "wall_polygons"]


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
    pieces: list[FloatArray] = []
    for shape in shapes:
        pieces.append(_triangles(shape, height))
        rings = (shape.exterior, *shape.interiors)
        pieces.extend(_sides(np.asarray(ring.coords)[:, :2], height) for ring in rings)
    return _mesh(np.concatenate(pieces))


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


def _sides(ring: FloatArray, height: float) -> FloatArray:
    """Corners of two triangles for every edge of a closed ring, shape (2 m, 3, 3)."""
    low = np.column_stack([ring, np.zeros(len(ring))])
    high = np.column_stack([ring, np.full(len(ring), height)])
    first = np.stack([low[:-1], low[1:], high[1:]], axis=1)
    second = np.stack([low[:-1], high[1:], high[:-1]], axis=1)
    return np.concatenate([first, second])


def _mesh(corners: FloatArray) -> TriangleMesh:
    vertices = np.asfortranarray(corners.reshape(-1, 3).T)
    faces = np.arange(vertices.shape[1], dtype=np.int32).reshape(-1, 3).T
    return TriangleMesh(vertices, np.asfortranarray(faces))
