"""Triangles of a polygon between points of its rings, fine enough that diagonals cross passages squarely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.geometry.pose import FloatArray

__all__ = ["IndexArray", "Triangles", "triangulate"]

IndexArray = NDArray[np.intp]

PER_GAP = 1.0
"""Longest piece of a ring, over its distance to the opposite wall [-]."""

FINEST = 500
"""Pieces are not shorter than this part of the polygon's size; finer passages get oblique diagonals."""


@dataclass(frozen=True)
class Triangles:
    """A triangulation of a polygon.

    Attributes:
        vertices: Points of the rings, shape (n, 2) [m].
        ring: Ring of each vertex, 0 for the outer one, shape (n,).
        corners: Vertices of each triangle, shape (t, 3).
        diagonals: Vertices of the edges between two triangles, shape (d, 2).
        neighbours: The two triangles on either side of them, shape (d, 2).
    """

    vertices: FloatArray
    ring: IndexArray
    corners: IndexArray
    diagonals: IndexArray
    neighbours: IndexArray


def triangulate(polygon: Polygon) -> Triangles:
    """Triangulate a polygon, its rings cut into pieces that are short where the opposite wall is near.

    Args:
        polygon: The region, with holes or without [m].
    """
    rings = [shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors)]
    walls = np.vstack([np.hstack((r[:-1], r[1:])) for r in rings])
    cut = [_cut_up(r, walls, polygon) for r in rings]
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(Polygon(cut[0], cut[1:])))
    points = np.vstack(cut)
    vertices, first = np.unique(points, axis=0, return_index=True)
    ring = np.repeat(np.arange(len(cut)), [len(r) for r in cut])[first]
    places = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    known, corners = np.unique(np.vstack((vertices, places.reshape(-1, 2))), axis=0, return_inverse=True)
    assert len(known) == len(vertices)
    corners = corners.ravel()[len(vertices) :].reshape(-1, 3)
    sides = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(corners)), 3)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    sides, owner = sides[order], owner[order]
    twice = np.flatnonzero((sides[1:] == sides[:-1]).all(axis=1))
    return Triangles(vertices, ring, corners, sides[twice], np.column_stack((owner[twice], owner[twice + 1])))


def _cut_up(ring: FloatArray, walls: FloatArray, polygon: Polygon) -> FloatArray:
    """Vertices of a ring with points between them, each once, shape (n, 2)."""
    finest = float(np.hypot(*np.subtract(polygon.bounds[2:], polygon.bounds[:2]))) / FINEST
    start, end = ring[:-1], ring[1:]
    edge = np.arange(len(start))
    own = np.hstack((start, end))
    while True:
        middle, length = 0.5 * (start + end), np.linalg.norm(end - start, axis=1)
        gap = _opposite(middle, own[edge], walls)
        long = length > np.maximum(PER_GAP * gap, finest)
        if not long.any():
            return start
        count = np.where(long, 2, 1)
        half = np.repeat(np.arange(len(start)), count)
        second = np.concatenate(([False], half[1:] == half[:-1]))
        first = np.concatenate((half[1:] == half[:-1], [False]))
        start, end = (
            np.where(second[:, None], middle[half], start[half]),
            np.where(first[:, None], middle[half], end[half]),
        )
        edge = edge[half]


def _opposite(points: FloatArray, own: FloatArray, walls: FloatArray) -> FloatArray:
    """Distance of points on walls ``own`` to the nearest wall that does not touch their own, shape (n,)."""
    a, d = walls[:, :2], walls[:, 2:] - walls[:, :2]
    offset = points[:, None] - a
    along = np.clip((offset * d).sum(axis=2) / np.maximum((d * d).sum(axis=1), 1e-300), 0.0, 1.0)
    distance = np.linalg.norm(offset - along[..., None] * d, axis=2)
    ends = np.stack((walls[:, :2], walls[:, 2:]), axis=1)
    mine = np.stack((own[:, :2], own[:, 2:]), axis=1)
    touches = (mine[:, None, :, None] == ends[None, :, None, :]).all(axis=4).any(axis=(2, 3))
    distance[touches] = np.inf
    return np.asarray(distance.min(axis=1))
