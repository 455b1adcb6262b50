"""Distances and crossings of points, segments and convex rings in the plane, compiled: one formula each.

A ring is a range of rows of an array of vertices, counter-clockwise: one vertex is a point, two are a
segment, more are a convex polygon.
"""

from __future__ import annotations

from math import hypot

from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray


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
