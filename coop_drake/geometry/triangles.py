"""Triangles of a polygon between points of its rings, fine enough that diagonals cross passages squarely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.geometry.polygons import edges_of
from coop_drake.geometry.passage import IndexArray, cut_edges
from coop_drake.geometry.polygons import extent_of
from coop_drake.tree.pose import FloatArray

PIECES_PER_GAP = 1.0
"""Least number of pieces on a stretch of a ring as long as its distance to the opposite wall [-]."""

FINEST = 500
"""Size of the polygon over the length of the shortest pieces [-]; finer passages get oblique diagonals."""


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
    """Triangulate a polygon, its rings cut into pieces that are short where the opposite wall is near."""
    polygon = shapely.remove_repeated_points(polygon)
    sizes = [len(ring.coords) - 1 for ring in (polygon.exterior, *polygon.interiors)]
    pieces, owners = cut_edges(edges_of(polygon), extent_of(polygon) / FINEST, np.inf, PIECES_PER_GAP)
    ring_of = np.repeat(np.arange(len(sizes)), sizes)[owners]
    cut = [pieces[ring_of == k] for k in range(len(sizes))]
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(Polygon(cut[0], cut[1:])))
    vertices, first = np.unique(pieces, axis=0, return_index=True)
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
