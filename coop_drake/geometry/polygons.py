"""Polygons and convex rings in the plane: their parts and edges, distances and crossings, one formula each.

In compiled functions a ring is a range of rows of an array of vertices, counter-clockwise: one vertex is a
point, two are a segment, more are a convex polygon.
"""

from __future__ import annotations

from math import hypot, sqrt
from typing import cast

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely import Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from coop_drake.errors import GeometryError
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray

# Distances and crossings of points, segments and convex rings.


@compiled
def twice_area(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> float:
    """Twice the signed area of the triangle a, b, c [m^2]: positive where c lies to the left of a to b."""
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


@compiled
def nearest_fraction(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> float:
    """Fraction of a segment's length, from (x0, y0), at which it is nearest to a point; 0 without length."""
    dx, dy = x1 - x0, y1 - y0
    squared_length = dx * dx + dy * dy
    s = ((x - x0) * dx + (y - y0) * dy) / squared_length if squared_length > 0.0 else 0.0
    return min(max(s, 0.0), 1.0)


@compiled
def squared_distance(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> float:
    """Squared distance of a point to the segment from (x0, y0) to (x1, y1), which may be a point [m^2]."""
    s = nearest_fraction(x, y, x0, y0, x1, y1)
    ex, ey = x - x0 - s * (x1 - x0), y - y0 - s * (y1 - y0)
    return ex * ex + ey * ey


@compiled
def ray_crosses(x: float, y: float, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether the ray from (x, y) along the x axis crosses a segment.

    A point is inside closed rings where its ray crosses an odd number of their edges. A vertex on the ray
    counts as below it, so that the ray crosses one of the two edges of a boundary that it passes there.
    """
    if (y0 > y) == (y1 > y):
        return False
    return (twice_area(x0, y0, x1, y1, x, y) > 0.0) == (y1 > y0)


@compiled
def segments_cross(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> bool:
    """Whether the segments a-b and c-d cross.

    An end that lies on the other segment's line counts as on its right side, so that a path through a vertex
    crosses one of the two edges there.
    """
    if (twice_area(ax, ay, bx, by, cx, cy) > 0.0) == (twice_area(ax, ay, bx, by, dx, dy) > 0.0):
        return False
    return (twice_area(cx, cy, dx, dy, ax, ay) > 0.0) != (twice_area(cx, cy, dx, dy, bx, by) > 0.0)


@compiled(borrows=True)
def meets_ring(
    vertices: FloatArray, first: int, last: int, ax: float, ay: float, bx: float, by: float
) -> bool:
    """Whether the segment a-b meets a ring or what it encloses; False for a ring of one vertex.

    The segment is clipped by the half-plane of every edge. One of length zero, with a = b, is a point: it is
    met where the ring has an interior that holds it. The ring is rows first to last - 1 of the vertices,
    shape (V, 2) [m].
    """
    if last - first == 1:
        return False
    if last - first == 2:
        ux, uy = vertices[first, 0], vertices[first, 1]
        return segments_cross(ax, ay, bx, by, ux, uy, vertices[first + 1, 0], vertices[first + 1, 1])
    enter, leave = 0.0, 1.0
    before = last - 1
    for k in range(first, last):
        nx, ny = vertices[k, 1] - vertices[before, 1], vertices[before, 0] - vertices[k, 0]
        left = nx * (vertices[before, 0] - ax) + ny * (vertices[before, 1] - ay)
        rate = nx * (bx - ax) + ny * (by - ay)
        before = k
        if rate > 0.0:
            leave = min(leave, left / rate)
        elif rate < 0.0:
            enter = max(enter, left / rate)
        elif left < 0.0:
            return False
        if enter > leave:
            return False
    return True


@compiled(borrows=True)
def squared_ring_distance(
    vertices: FloatArray, first: int, last: int, ax: float, ay: float, bx: float, by: float, most: float
) -> float:
    """Squared distance of the segment a-b from the edges of a ring that it does not cross, at most ``most``.

    Segments that do not cross are nearest at an end of one of them. Arguments as in ``meets_ring``.
    """
    best = most
    before = last - 1
    for k in range(first, last):
        ux, uy, wx, wy = vertices[before, 0], vertices[before, 1], vertices[k, 0], vertices[k, 1]
        before = k
        best = min(best, squared_distance(wx, wy, ax, ay, bx, by))
        best = min(best, squared_distance(ax, ay, ux, uy, wx, wy))
        best = min(best, squared_distance(bx, by, ux, uy, wx, wy))
    return best


@compiled(borrows=True)
def separated(first: FloatArray, second: FloatArray, gap: float = 0.0) -> bool:
    """Whether the line of some edge keeps two convex polygons further apart than ``gap`` [m].

    With a negative gap polygons that overlap less deep than that count as separated, too.
    """
    for _ in range(2):
        for i in range(len(first)):
            k = i + 1 if i + 1 < len(first) else 0
            x, y = first[k, 1] - first[i, 1], first[i, 0] - first[k, 0]
            reach = x * first[i, 0] + y * first[i, 1] + gap * hypot(x, y)
            apart = True
            for j in range(len(second)):
                if x * second[j, 0] + y * second[j, 1] <= reach:
                    apart = False
                    break
            if apart:
                return True
        first, second = second, first
    return False


# The polygons among the parts of a shape, and the corners of their rings.


def parts_of(shape: BaseGeometry) -> list[Polygon]:
    """The polygons that a shape consists of; lines, points and empty polygons are dropped."""
    if isinstance(shape, Polygon):
        return [] if shape.is_empty else [shape]
    parts = shapely.get_parts(shape)
    return [part for part in parts if isinstance(part, Polygon) and not part.is_empty]


def corners_of(polygon: Polygon) -> list[FloatArray]:
    """The corners of every ring as it stands, the outer ring first, none repeated, shape (n, 2) each [m]."""
    return [shapely.get_coordinates(ring)[:-1] for ring in (polygon.exterior, *polygon.interiors)]


def polygon_rings(shape: BaseGeometry) -> list[FloatArray]:
    """The corners of all rings of a shape's polygons, outer rings counter-clockwise, holes clockwise [m]."""
    return [corners for part in parts_of(shape) for corners in corners_of(orient(part))]


def extent_of(shape: BaseGeometry) -> float:
    """Diagonal of the bounding box of a shape [m]."""
    x_min, y_min, x_max, y_max = shape.bounds
    return float(np.hypot(x_max - x_min, y_max - y_min))


def component_at(shape: BaseGeometry, point: Point) -> Polygon:
    """The polygon among the parts of a shape that holds a point, an empty one if none does."""
    for part in parts_of(shape):
        if part.contains(point):
            return part
    return Polygon()


# Exact signed distance from points to the boundary of a polygon, fast enough for a control loop.


def edges_of(polygon: Polygon) -> FloatArray:
    """Edges of every ring of a polygon as rows ``(x0, y0, x1, y1)``, shape (edges, 4) [m]."""
    if not polygon.interiors:
        ring = shapely.get_coordinates(polygon)
        return np.hstack([ring[:-1], ring[1:]])
    rings = [shapely.get_coordinates(ring) for ring in (polygon.exterior, *polygon.interiors)]
    return np.vstack([np.hstack([ring[:-1], ring[1:]]) for ring in rings])


@compiled(borrows=True)
def signed_distance(edges: FloatArray, x: float, y: float) -> float:
    """Distance of a point to the nearest edge [m], positive inside: a ray from there crosses an odd number.

    The edges (x0, y0, x1, y1) are those of closed rings, shape (E, 4) [m].
    """
    nearest = np.inf
    inside = False
    for k in range(edges.shape[0]):
        x0, y0, x1, y1 = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        nearest = min(nearest, squared_distance(x, y, x0, y0, x1, y1))
        if ray_crosses(x, y, x0, y0, x1, y1):
            inside = not inside
    return sqrt(nearest) if inside else -sqrt(nearest)


@compiled
def _segment_clearances(edges: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Distances of many segments, whose ends have the shape (n, 2) each, from the nearest edge, (n,) [m].

    Zero where they cross.
    """
    result = np.empty(len(starts))
    for i in range(len(starts)):
        ax, ay, bx, by = starts[i, 0], starts[i, 1], ends[i, 0], ends[i, 1]
        nearest = np.inf
        for k in range(edges.shape[0]):
            x0, y0, x1, y1 = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
            if segments_cross(ax, ay, bx, by, x0, y0, x1, y1):
                nearest = 0.0
                break
            nearest = min(nearest, squared_distance(ax, ay, x0, y0, x1, y1))
            nearest = min(nearest, squared_distance(bx, by, x0, y0, x1, y1))
            nearest = min(nearest, squared_distance(x0, y0, ax, ay, bx, by))
            nearest = min(nearest, squared_distance(x1, y1, ax, ay, bx, by))
        result[i] = sqrt(nearest)
    return result


@compiled
def _signed_distances(edges: FloatArray, points: FloatArray) -> FloatArray:
    """Signed distance of many points, shape (n, 2) -> (n,) [m]."""
    result = np.empty(points.shape[0])
    for k in range(points.shape[0]):
        result[k] = signed_distance(edges, points[k, 0], points[k, 1])
    return result


class BoundaryDistance:
    """Signed distance to the boundary of a polygon with holes, d of (15).

    Args:
        polygon: The region, with holes or without [m].

    Attributes:
        edges: Edges of every ring as rows ``(x0, y0, x1, y1)``, shape (edges, 4) [m].

    Raises:
        GeometryError: If the polygon is empty.
    """

    def __init__(self, polygon: Polygon) -> None:
        if polygon.is_empty:
            raise GeometryError("an empty polygon has no boundary to measure a distance to")
        self.edges = np.ascontiguousarray(edges_of(polygon))

    def __call__(self, point: ArrayLike) -> float:
        """Distance of one point, shape (2,) [m], to the boundary: positive inside, negative outside [m]."""
        x, y = cast(FloatArray, point)
        return signed_distance(self.edges, float(x), float(y))

    def batch(self, points: ArrayLike) -> FloatArray:
        """Distances of many points, shape (n, 2) to (n,) [m], positive inside, negative outside."""
        rows = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
        return _signed_distances(self.edges, rows)

    def shortened(self, points: FloatArray) -> FloatArray:
        """A way without points that it can do without: straight on it keeps the clearance of the whole way.

        Args:
            points: The way, shape (n, 2) [m].
        """
        clearance = self.along(points[:-1], points[1:]).min(initial=np.inf)
        kept, here = [0], 0
        while here < len(points) - 1:
            there = here + 1
            while there + 1 < len(points):
                ahead = points[there + 1 : there + 2]
                if self.along(points[here : here + 1], ahead)[0] < clearance:
                    break
                there += 1
            kept.append(there)
            here = there
        shorter: FloatArray = points[kept]
        return shorter

    def along(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Smallest distances of straight segments to the boundary, shapes (n, 2) each to (n,) [m].

        Zero where a segment crosses the boundary; also positive for a segment that lies outside.

        Raises:
            ValueError: If there are not as many starts as ends.
        """
        if starts.shape != ends.shape:
            raise ValueError(f"starts have the shape {starts.shape}, ends the shape {ends.shape}")
        return _segment_clearances(self.edges, np.ascontiguousarray(starts), np.ascontiguousarray(ends))
