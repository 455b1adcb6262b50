"""Compiled over-sweeps, eq. (6): a convex piece is swept by one joint after the other, up to the object.

Every set is given by its support function in some directions, and enclosed by the lines that support it.
"""

from __future__ import annotations

from math import atan2, ceil, cos, floor, hypot, pi, sin, sqrt

import numpy as np

from coop_drake.geometry.sweeps import SLACK
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

_TURN = 2.0 * pi

_SAME_ANGLE = 1e-5
"""Directions closer than this count as one [rad]: their lines would meet too far away to be computed."""

_SAME_POINT = 1e-11
"""Vertices closer than this count as one [m], well below ``SLACK``."""

_LARGEST_TURN = 0.75 * pi
"""Largest angle between neighbouring directions [rad]: below pi, so that neighbouring lines meet."""

_PARTS_PER_ANGLE = 10.0
"""Squared number of parts of an arc over its half-angle [1/rad]: the error of the parts is small against
the growth of the sweep itself."""


@compiled
def arc_parts(half_width: float) -> int:
    """Number of chords or tangents that replace an arc, given half of its angle [rad].

    Their error vanishes faster than the slice's width.
    """
    return max(1, ceil(sqrt(_PARTS_PER_ANGLE * min(half_width, pi))))


@compiled
def disc_turn(half_width: float) -> float:
    """Largest angle between neighbouring normals of a polygon that replaces a disc [rad].

    The wider the widest interval of the sweep, of which half is given [rad or m], the coarser the polygon.
    """
    return min(0.6, max(0.05, 0.9 * sqrt(half_width))) if half_width > 0.0 else 0.6


@compiled(borrows=True)
def sort(values: FloatArray) -> None:
    """Sort a short array in place by insertion; numpy's sort takes longer to compile, and as long to run."""
    for i in range(1, len(values)):
        value, k = values[i], i
        while k > 0 and values[k - 1] > value:
            values[k] = values[k - 1]
            k -= 1
        values[k] = value


@compiled
def closed_directions(angles: FloatArray, largest_turn: float) -> FloatArray:
    """Sort directions, drop repeated ones and fill gaps so that no two neighbours are further apart.

    Args:
        angles: Any directions, shape (k,) [rad].
        largest_turn: Largest angle between neighbours of the result [rad], below pi.

    Returns:
        Directions in ascending order within one turn, shape (m,).
    """
    ordered = np.zeros(max(len(angles), 1))
    for i in range(len(angles)):
        ordered[i] = angles[i] - _TURN * floor(angles[i] / _TURN)
    sort(ordered)
    kept = np.empty(len(ordered))
    count = 0
    for i in range(len(ordered)):
        before = ordered[i - 1] if i > 0 else ordered[-1] - _TURN
        if ordered[i] - before > _SAME_ANGLE:
            kept[count] = ordered[i]
            count += 1
    total = 0
    for i in range(count):
        after = kept[i + 1] if i + 1 < count else kept[0] + _TURN
        total += ceil((after - kept[i]) / largest_turn)
    filled = np.empty(total)
    size = 0
    for i in range(count):
        after = kept[i + 1] if i + 1 < count else kept[0] + _TURN
        parts = ceil((after - kept[i]) / largest_turn)
        for part in range(parts):
            filled[size] = kept[i] + part * ((after - kept[i]) / parts)
            size += 1
    return filled


@compiled
def circumscribed(angles: FloatArray, offsets: FloatArray) -> FloatArray:
    """Polygon whose edges lie on supporting lines of one convex set; it encloses that set.

    Args:
        angles: Sorted directions, neighbours less than pi apart, shape (k,) [rad].
        offsets: Value of the set's support function at each, shape (k,) [m].

    Returns:
        Vertices, counter-clockwise, without repetitions, shape (m, 2).
    """
    count = len(angles)
    x, y = np.empty(count), np.empty(count)
    for i in range(count):
        x[i], y[i] = cos(angles[i]), sin(angles[i])
    vertices = np.empty((count, 2))
    for i in range(count):
        k = i + 1 if i + 1 < count else 0
        here, after = offsets[i] + SLACK, offsets[k] + SLACK
        turn = x[i] * y[k] - y[i] * x[k]
        vertices[i, 0] = (here * y[k] - after * y[i]) / turn
        vertices[i, 1] = (after * x[i] - here * x[k]) / turn
    distinct = np.empty((count, 2))
    size = 0
    for i in range(count):
        step = max(abs(vertices[i, 0] - vertices[i - 1, 0]), abs(vertices[i, 1] - vertices[i - 1, 1]))
        if step > _SAME_POINT:
            distinct[size, 0], distinct[size, 1] = vertices[i, 0], vertices[i, 1]
            size += 1
    return distinct[:size] if size >= 3 else vertices


@compiled
def support(vertices: FloatArray, angles: FloatArray) -> FloatArray:
    """Support function of the hull of the vertices: largest n . v; shapes (n, 2), (k,) to (k,) [m]."""
    best = np.empty(len(angles))
    for i in range(len(angles)):
        x, y = cos(angles[i]), sin(angles[i])
        best[i] = x * vertices[0, 0] + y * vertices[0, 1]
        for k in range(1, len(vertices)):
            best[i] = max(best[i], x * vertices[k, 0] + y * vertices[k, 1])
    return best


@compiled
def edge_directions(vertices: FloatArray) -> FloatArray:
    """Angles of the outward normals of a counter-clockwise ring; shape (n, 2) to (n,), empty for a point.

    Two vertices make a segment with a normal on either side.
    """
    count = len(vertices) if len(vertices) > 1 else 0
    angles = np.empty(count)
    for i in range(count):
        k = i + 1 if i + 1 < count else 0
        angles[i] = atan2(vertices[i, 0] - vertices[k, 0], vertices[k, 1] - vertices[i, 1])
    return angles


@compiled(borrows=True)
def _furthest(vertices: FloatArray, i: int) -> bool:
    """Whether vertex i of a ring is no nearer to the origin than the points next to it on its two edges."""
    after = i + 1 if i + 1 < len(vertices) else 0
    x, y = vertices[i, 0], vertices[i, 1]
    ax, ay, bx, by = vertices[i - 1, 0], vertices[i - 1, 1], vertices[after, 0], vertices[after, 1]
    outermost: bool = (bx - x) * x + (by - y) * y <= 0.0 and (ax - x) * x + (ay - y) * y <= 0.0
    return outermost


@compiled
def over_revolute(vertices: FloatArray, centre: float, half_width: float) -> FloatArray:
    """Enclose a convex set turned about the origin by every angle of an interval.

    The support function of the sweep is the largest of the set's over a window of directions. Its
    directions are the edges' normals at both ends of the interval, and tangents to the arcs of those
    vertices that are locally furthest from the pivot.

    Args:
        vertices: Convex ring, counter-clockwise, or one point or a segment, shape (n, 2) [m].
        centre: Middle of the interval [rad].
        half_width: Half of its width [rad].

    Returns:
        Vertices of an enclosing convex polygon, shape (m, 2).
    """
    count, parts = len(vertices), arc_parts(half_width)
    edges = edge_directions(vertices)
    radii = np.empty(count)
    angles = np.empty(2 * len(edges) + count * (parts + 1) + 4)
    size = 0
    for i in range(len(edges)):
        angles[size], angles[size + 1] = edges[i] - half_width, edges[i] + half_width
        size += 2
    for i in range(count):
        radii[i] = hypot(vertices[i, 0], vertices[i, 1])
        if radii[i] > 0.0 and _furthest(vertices, i):
            bearing = atan2(vertices[i, 1], vertices[i, 0])
            for part in range(parts + 1):
                angles[size] = bearing + half_width * (2.0 * part / parts - 1.0)
                size += 1
    for quarter in range(4 if count < 3 else 0):
        angles[size] = atan2(vertices[0, 1], vertices[0, 0]) + 0.5 * pi * quarter
        size += 1
    for i in range(size):
        angles[i] += centre
    directions = closed_directions(angles[:size], _LARGEST_TURN)
    offsets = np.empty(len(directions))
    window = min(half_width, pi)
    c, s = cos(window), sin(window)
    for k in range(len(directions)):
        x, y = cos(directions[k] - centre), sin(directions[k] - centre)
        best = -np.inf
        for i in range(count):
            along = x * vertices[i, 0] + y * vertices[i, 1]
            across = abs(x * vertices[i, 1] - y * vertices[i, 0])
            inside = along >= c * radii[i]  # Some angle of the interval turns the vertex into this direction.
            best = max(best, radii[i] if inside else c * along + s * across)
        offsets[k] = best
    return circumscribed(directions, offsets)


@compiled
def over_prismatic(vertices: FloatArray, x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    """Enclose a convex set moved by every displacement from (x0, y0) to (x1, y1) [m]: the hull of both ends.

    The set is a convex ring, one point or a segment, shape (n, 2) [m].
    """
    edges = edge_directions(vertices)
    angles = np.empty(len(edges) + 4)
    for i in range(len(edges)):
        angles[i] = edges[i]
    heading = atan2(y1 - y0, x1 - x0)
    for quarter in range(4):
        angles[len(edges) + quarter] = heading + 0.5 * pi * (quarter - 1.0)
    directions = closed_directions(angles, _LARGEST_TURN)
    offsets = support(vertices, directions)
    for k in range(len(directions)):
        x, y = cos(directions[k]), sin(directions[k])
        offsets[k] += max(x * x0 + y * y0, x * x1 + y * y1)
    return circumscribed(directions, offsets)


@compiled
def grown(vertices: FloatArray, radius: float, largest_turn: float) -> FloatArray:
    """Enclose a convex set grown by a radius [m] in a polygon.

    The set is a convex ring, one point or a segment, shape (n, 2) [m]; neighbouring normals of the polygon
    are at most ``largest_turn`` apart [rad].
    """
    directions = closed_directions(edge_directions(vertices), largest_turn)
    offsets = support(vertices, directions)
    for k in range(len(offsets)):
        offsets[k] += radius
    return circumscribed(directions, offsets)
