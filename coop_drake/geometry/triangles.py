"""Triangles of a polygon between points of its rings, fine enough that diagonals cross passages squarely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.geometry.boundary import edges_of
from coop_drake.tree.pose import FloatArray

__all__ = ["IndexArray", "Triangles", "triangulate"]

IndexArray = NDArray[np.intp]

PER_GAP = 1.0
"""Longest piece of a ring, over its distance to the opposite wall [-]."""

AT_ONCE = 250_000
"""Pairs of points and walls that are measured at once, lest large floors fill the memory."""

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
    polygon = shapely.remove_repeated_points(polygon)
    walls = edges_of(polygon)
    sizes = [len(ring.coords) - 1 for ring in (polygon.exterior, *polygon.interiors)]
    finest = float(np.hypot(*np.subtract(polygon.bounds[2:], polygon.bounds[:2]))) / FINEST
    pieces = _cut_up(walls, finest)
    ring_of = np.repeat(np.arange(len(sizes)), sizes)[pieces[:, 2].astype(np.intp)]
    cut = [pieces[ring_of == k, :2] for k in range(len(sizes))]
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(Polygon(cut[0], cut[1:])))
    vertices, first = np.unique(pieces[:, :2], axis=0, return_index=True)
    places = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    known, corners = np.unique(np.vstack((vertices, places.reshape(-1, 2))), axis=0, return_inverse=True)
    assert len(known) == len(vertices)  # no triangle has a corner of its own
    corners = corners.ravel()[len(vertices) :].reshape(-1, 3)
    sides = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(corners)), 3)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    sides, owner = sides[order], owner[order]
    twice = np.flatnonzero((sides[1:] == sides[:-1]).all(axis=1))
    return Triangles(
        vertices, ring_of[first], corners, sides[twice], np.column_stack((owner[twice], owner[twice + 1]))
    )


def _cut_up(walls: FloatArray, finest: float) -> FloatArray:
    """Starts of the pieces of all walls in order, and the wall of each: rows (x, y, wall)."""
    z = walls @ np.array([[1.0, 0.0], [1.0j, 0.0], [0.0, 1.0], [0.0, 1.0j]])
    wall, part = np.arange(len(z)), np.array([[0.0, 1.0]] * len(z))
    done = []
    while len(wall):
        middle = z[wall, 0] + part.mean(axis=1) * (z[wall, 1] - z[wall, 0])
        length = (part[:, 1] - part[:, 0]) * np.abs(z[wall, 1] - z[wall, 0])
        long = length > np.maximum(PER_GAP * _opposite(middle, wall, z), finest)
        done.append(np.column_stack((wall[~long], part[~long, 0])))
        low, high = part[long].T
        half = 0.5 * (low + high)
        wall = np.tile(wall[long], 2)
        part = np.vstack((np.column_stack((low, half)), np.column_stack((half, high))))
    rows = np.concatenate(done)
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    of = rows[:, 0].astype(np.intp)
    places = walls[of, :2] + rows[:, 1:] * (walls[of, 2:] - walls[of, :2])
    return np.column_stack((places, of))


def _opposite(points: NDArray[np.complex128], wall: IndexArray, walls: NDArray[np.complex128]) -> FloatArray:
    """Distance of points on walls to the nearest wall that does not touch their own, shape (points,)."""
    along = walls[:, 1] - walls[:, 0]
    squared = np.maximum(np.abs(along) ** 2, 1e-300)
    nearest = [
        _nearest(points[rows], walls[wall[rows]], walls, along, squared)
        for rows in np.array_split(np.arange(len(points)), 1 + len(points) * len(walls) // AT_ONCE)
    ]
    return np.concatenate(nearest)


def _nearest(
    points: NDArray[np.complex128], own: NDArray[np.complex128], walls: NDArray[np.complex128],
    along: NDArray[np.complex128], squared: FloatArray,
) -> FloatArray:  # fmt: skip
    """Distance of each point to the nearest wall that does not touch its own wall.

    Args:
        points: Points on walls, shape (points,) [m].
        own: Ends of the wall of each, shape (points, 2) [m].
        walls: Ends of all walls, shape (walls, 2) [m].
        along: Vectors from their first to their second end, shape (walls,) [m].
        squared: Squared lengths of these, shape (walls,) [m^2].

    Returns:
        Distances, shape (points,) [m].
    """
    touching = (own[:, None, :, None] == walls[None, :, None, :]).any(axis=(2, 3))
    offset = points[:, None] - walls[:, 0]
    part = np.clip((np.conj(along) * offset).real / squared, 0.0, 1.0)
    return np.asarray(np.where(touching, np.inf, np.abs(offset - part * along)).min(axis=1))
