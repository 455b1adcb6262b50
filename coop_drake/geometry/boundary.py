"""Exact signed distance from points to the boundary of a polygon, fast enough for a control loop."""

from __future__ import annotations

from math import sqrt
from typing import cast

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely import Polygon

from coop_drake.compiled import compiled
from coop_drake.errors import GeometryError
from coop_drake.tree.pose import FloatArray

__all__ = ["BoundaryDistance", "edges_of", "signed_distance", "squared_distance"]


def edges_of(polygon: Polygon) -> FloatArray:
    """Edges of every ring of a polygon as rows ``(x0, y0, x1, y1)``, shape (edges, 4) [m]."""
    rings = [shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors)]
    return np.vstack([np.hstack([ring[:-1], ring[1:]]) for ring in rings])


@compiled
def squared_distance(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> float:
    """Squared distance of a point to the segment from (x0, y0) to (x1, y1), which may be a point."""
    dx, dy = x1 - x0, y1 - y0
    px, py = x - x0, y - y0
    squared_length = dx * dx + dy * dy
    s = (px * dx + py * dy) / squared_length if squared_length > 0.0 else 0.0
    s = min(max(s, 0.0), 1.0)
    ex, ey = px - s * dx, py - s * dy
    return ex * ex + ey * ey


@compiled
def signed_distance(edges: FloatArray, x: float, y: float) -> float:
    """Distance to the nearest edge, positive where a ray to the right crosses an odd number of edges."""
    nearest = np.inf
    inside = False
    for k in range(edges.shape[0]):
        x0, y0, x1, y1 = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        nearest = min(nearest, squared_distance(x, y, x0, y0, x1, y1))
        if (y0 > y) != (y1 > y) and ((x - x0) * (y1 - y0) < (y - y0) * (x1 - x0)) == (y1 > y0):
            inside = not inside
    return sqrt(nearest) if inside else -sqrt(nearest)


@compiled
def _segment_clearance(edges: FloatArray, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance between the segment from a to b and the nearest edge, zero where they cross."""
    nearest = np.inf
    for k in range(edges.shape[0]):
        cx, cy, dx, dy = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        side_c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        side_d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
        side_a = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
        side_b = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
        if side_c * side_d < 0.0 and side_a * side_b < 0.0:
            return 0.0
        nearest = min(nearest, squared_distance(ax, ay, cx, cy, dx, dy))
        nearest = min(nearest, squared_distance(bx, by, cx, cy, dx, dy))
        nearest = min(nearest, squared_distance(cx, cy, ax, ay, bx, by))
        nearest = min(nearest, squared_distance(dx, dy, ax, ay, bx, by))
    return sqrt(nearest)


@compiled
def _signed_distances(edges: FloatArray, points: FloatArray) -> FloatArray:
    """The same for many points, shape (n, 2) -> (n,)."""
    result = np.empty(points.shape[0])
    for k in range(points.shape[0]):
        result[k] = signed_distance(edges, points[k, 0], points[k, 1])
    return result


class BoundaryDistance:
    """Signed distance to the boundary of a polygon with holes, d of (15).

    Args:
        polygon: The region, with holes or without [m].

    Raises:
        GeometryError: If the polygon is empty.
    """

    def __init__(self, polygon: Polygon) -> None:
        if polygon.is_empty:
            raise GeometryError("an empty polygon has no boundary to measure a distance to")
        self._edges = np.ascontiguousarray(edges_of(polygon))

    @property
    def edges(self) -> FloatArray:
        """Edges of every ring as rows ``(x0, y0, x1, y1)``, shape (edges, 4) [m]."""
        return self._edges

    def __call__(self, point: ArrayLike) -> float:
        """Distance of one point to the boundary.

        Args:
            point: Position, shape (2,) [m].

        Returns:
            Distance [m], positive inside the polygon, negative outside.
        """
        x, y = cast(FloatArray, point)
        return signed_distance(self._edges, float(x), float(y))

    def batch(self, points: ArrayLike) -> FloatArray:
        """Distances of many points.

        Args:
            points: Positions, shape (n, 2) [m].

        Returns:
            Distances, shape (n,) [m], positive inside the polygon, negative outside.
        """
        rows = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
        return _signed_distances(self._edges, rows)

    def along(self, start: ArrayLike, end: ArrayLike) -> float:
        """Smallest distance of a straight segment to the boundary.

        Args:
            start: One end, shape (2,) [m].
            end: The other end, shape (2,) [m].

        Returns:
            Distance [m], zero where the segment crosses the boundary, also for a segment that lies outside.
        """
        (ax, ay), (bx, by) = cast(FloatArray, start), cast(FloatArray, end)
        return _segment_clearance(self._edges, float(ax), float(ay), float(bx), float(by))
