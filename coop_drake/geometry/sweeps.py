"""Sweeps of convex pieces, eq. (6): polygons that enclose them in a slice, or that they cover all over it."""

from __future__ import annotations

from math import atan2, ceil, cos, floor, hypot, pi, sin, sqrt

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import TeamArrays, moved

# Convex polygons as sets of supporting lines ``n(angle) . x <= offset``: the arithmetic of all sweeps.

SLACK = 1e-9
"""Directed rounding [m]: outer offsets grow and inner offsets shrink by it."""

TOUCH = 1e-6
"""Swept bodies closer than this touch [m]."""


def following(ring: FloatArray) -> FloatArray:
    """Rotate a ring by one entry, so that entry i is what followed entry i; the shape (n, ...) stays."""
    return np.concatenate((ring[1:], ring[:1]))


def normals(angles: FloatArray) -> FloatArray:
    """Unit vectors at the angles; shape (k,) [rad] to (k, 2)."""
    result = np.empty((*angles.shape, 2))
    np.cos(angles, out=result[..., 0])
    np.sin(angles, out=result[..., 1])
    return result


# Compiled over-sweeps, eq. (6): a convex piece is swept by one joint after the other, up to the object.
#
# Every set is given by its support function in some directions, and enclosed by the lines that support it.

_TURN = 2.0 * pi

_SAME_ANGLE = 1e-5
"""Directions closer than this count as one [rad]: their lines would meet too far away to be computed."""

_SAME_POINT = 1e-11
"""Vertices closer than this count as one [m], well below ``SLACK``."""

_LARGEST_TURN = 0.75 * pi
"""Largest angle between neighbouring directions [rad]: below pi, so that neighbouring lines meet."""

_PARTS_PER_ANGLE = 10.0
"""Squared number of chords or tangents that replace an arc over its half-angle [1/rad]: their error vanishes
faster than the slice's width, and is small against the growth of the sweep itself."""


@compiled(borrows=True)
def arc_parts(half_width: float) -> int:
    """Number of chords or tangents that replace an arc of a half-angle, of half a turn at most [rad]."""
    return max(1, ceil(sqrt(_PARTS_PER_ANGLE * min(half_width, pi))))


@compiled
def disc_turn(half_width: float) -> float:
    """Largest angle between neighbouring normals of a polygon that replaces a disc [rad].

    The wider the widest interval of the sweep, of which half is given [rad or m], the coarser the polygon.
    """
    return min(0.6, max(0.05, 0.9 * sqrt(half_width))) if half_width > 0.0 else 0.6


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
        # Few numbers are sorted as quickly by insertion as by numpy, whose sort takes longer to compile.
        angle, k = angles[i] - _TURN * floor(angles[i] / _TURN), i
        while k > 0 and ordered[k - 1] > angle:
            ordered[k] = ordered[k - 1]
            k -= 1
        ordered[k] = angle
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
        x, y = vertices[i, 0], vertices[i, 1]
        radii[i] = hypot(x, y)
        # The points next to the vertex on its two edges are no further from the origin.
        after = i + 1 if i + 1 < count else 0
        ax, ay, bx, by = vertices[i - 1, 0], vertices[i - 1, 1], vertices[after, 0], vertices[after, 1]
        outermost = (bx - x) * x + (by - y) * y <= 0.0 and (ax - x) * x + (ay - y) * y <= 0.0
        if radii[i] > 0.0 and outermost:
            bearing = atan2(y, x)
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
    """Enclose a convex set grown by a radius [m] in a polygon; it is the set itself where that is zero.

    The set is a convex ring, one point or a segment, shape (n, 2) [m]; neighbouring normals of the polygon
    are at most ``largest_turn`` apart [rad].
    """
    if radius == 0.0:
        return vertices
    directions = closed_directions(edge_directions(vertices), largest_turn)
    offsets = support(vertices, directions)
    for k in range(len(offsets)):
        offsets[k] += radius
    return circumscribed(directions, offsets)


# Compiled under-sweeps: intersections of half-planes or discs, rounded inwards; no rows where empty.

_SAME_NORMAL = 1e-12
"""Lines whose normals differ by less count as parallel, and the inner one is kept [rad]."""

_PARALLEL = 1e-12
"""Lines whose normals have a smaller sine between them count as parallel [-]."""

_SHORTEST_EDGE = 1e-9
"""Shorter edges are left out [m]: they are within the rounding ``SLACK``."""


@compiled
def half_planes_polygon(angles: FloatArray, offsets: FloatArray) -> FloatArray:
    """Intersection of half-planes that bound a polygon, rounded inwards by ``SLACK``.

    Line i keeps the stretch between the largest of its lower and the smallest of its upper crossings with
    all the others.

    Args:
        angles: Directions of the outward normals, shape (k,) [rad].
        offsets: Signed distances of the lines from the origin, shape (k,) [m].

    Returns:
        Vertices, counter-clockwise, shape (m, 2); no rows where the intersection has no interior.
    """
    x, y, h, turned = (
        np.empty(len(angles)),
        np.empty(len(angles)),
        np.empty(len(angles)),
        np.empty(len(angles)),
    )
    count = 0
    for i in range(len(angles)):
        angle, offset = angles[i] - _TURN * floor(angles[i] / _TURN), offsets[i] - SLACK
        k = count
        while k > 0 and turned[k - 1] > angle:
            turned[k], h[k] = turned[k - 1], h[k - 1]
            k -= 1
        turned[k], h[k] = angle, offset
        count += 1
    lines, count = count, 0
    for i in range(lines):
        if count > 0 and turned[i] - turned[count - 1] <= _SAME_NORMAL:
            h[count - 1] = min(h[count - 1], h[i])
            continue
        turned[count], h[count] = turned[i], h[i]
        x[count], y[count] = cos(turned[i]), sin(turned[i])
        count += 1
    vertices = np.empty((count, 2))
    size = 0
    for i in range(count):
        lower, upper = -np.inf, np.inf
        for j in range(count):
            sine = x[i] * y[j] - y[i] * x[j]
            left = h[j] - h[i] * (x[i] * x[j] + y[i] * y[j])
            if abs(sine) < _PARALLEL:
                if left < -_PARALLEL:
                    upper = -np.inf
            elif sine > 0.0:
                upper = min(upper, left / sine)
            else:
                lower = max(lower, left / sine)
        if upper - lower > _SHORTEST_EDGE:
            vertices[size, 0], vertices[size, 1] = h[i] * x[i] - upper * y[i], h[i] * y[i] + upper * x[i]
            size += 1
    return vertices[: size if size >= 3 else 0]


def shrunk(vertices: FloatArray, distance: float) -> FloatArray:
    """Find points that keep a distance from the boundary of a convex polygon.

    Args:
        vertices: Convex ring, counter-clockwise, shape (n, 2) [m].
        distance: The distance [m].

    Returns:
        Vertices of a convex polygon, shape (m, 2); no rows where it has no interior.
    """
    angles = edge_directions(vertices)
    found: FloatArray = half_planes_polygon(angles, support(vertices, angles) - distance)
    return found


def under_revolute(vertices: FloatArray, centre: float, half_width: float) -> FloatArray:
    """Find points that a convex polygon covers at every angle of an interval about the origin.

    Every half-plane becomes its two extreme turns and, where it holds the pivot, chords of the circle that
    it envelops. A half-plane without the pivot and a turn by pi or more have no common points.

    Args:
        vertices: Convex ring, counter-clockwise, shape (n, 2) [m].
        centre: Middle of the interval [rad].
        half_width: Half of its width [rad].

    Returns:
        Vertices of an enclosed convex polygon, shape (m, 2); no rows where none was found.
    """
    half_width = min(half_width, pi)  # A joint of many turns covers no more; its chords would leap over arcs.
    edges = edge_directions(vertices)
    offsets = support(vertices, edges)
    round_pivot = offsets > 0.0
    if half_width >= 0.5 * pi and not round_pivot.all():
        return np.empty((0, 2))
    parts = arc_parts(half_width)
    half_chord = half_width / parts
    chords = half_chord * (2.0 * np.arange(parts) + 1.0 - parts)
    angles = (centre + edges, centre + edges[round_pivot])
    turned = (angles[0] - half_width, angles[0] + half_width, np.add.outer(angles[1], chords).ravel())
    distances = (offsets, offsets, np.repeat(offsets[round_pivot] * cos(half_chord), parts))
    return half_planes_polygon(np.concatenate(turned), np.concatenate(distances))


def under_prismatic(vertices: FloatArray, x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    """Find points that a convex polygon covers at every displacement from (x0, y0) to (x1, y1) [m].

    They are the points that both end copies cover; no rows where there are none. The ring is
    counter-clockwise, shape (n, 2) [m].
    """
    angles = edge_directions(vertices)
    offsets = support(vertices, angles)
    for k in range(len(angles)):
        x, y = cos(angles[k]), sin(angles[k])
        offsets[k] += min(x * x0 + y * y0, x * x1 + y * y1)
    return half_planes_polygon(angles, offsets)


def common_disc(centres: FloatArray, radius: float, largest_turn: float) -> FloatArray:
    """Polygon inside every disc of one radius [m] whose centre lies in a convex polygon, shape (n, 2) [m].

    A point is within the radius of every centre if it is of every vertex; from their middle each ray leaves
    the common part at the nearest exit. Neighbouring vertices of the result are ``largest_turn`` apart [rad];
    it has no rows where the discs have no common part.
    """
    middle = 0.5 * (centres.min(axis=0) + centres.max(axis=0))
    off = middle - centres
    beyond = radius * radius - off[:, 0] * off[:, 0] - off[:, 1] * off[:, 1]
    if beyond.min() <= 0.0:
        return np.empty((0, 2))
    directions = np.array(
        [(cos(angle), sin(angle)) for angle in closed_directions(np.empty(0), largest_turn)]
    )
    along = np.multiply.outer(directions[:, 0], off[:, 0]) + np.multiply.outer(directions[:, 1], off[:, 1])
    reach = (np.sqrt(along * along + beyond) - along).min(axis=1) * (1.0 - 1e-9)
    ring: FloatArray = middle + reach[:, None] * directions
    return ring


# Compiled over-sweeps of a team's pieces, eq. (6): through one joint after the other, up to the object.


@compiled
def over_joint(
    team: TeamArrays, link: int, vertices: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """Enclose a convex set that one joint moves through its interval, eq. (6).

    Args:
        team: The team.
        link: Index of the component that the joint moves; the object's is turned by theta.
        vertices: The set in that component's frame, see ``over_revolute``, shape (n, 2) [m].
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).

    Returns:
        Vertices in the parent's frame, in W for the object's component, shape (m, 2) [m].
    """
    axis = team.links[link, 1] - 2
    low, high = lower[axis], upper[axis]
    if team.links[link, 2] == 1:
        ring = over_revolute(vertices, team.joints[link, 3] * 0.5 * (low + high), 0.5 * (high - low))
    else:
        ax, ay = team.joints[link, 4], team.joints[link, 5]
        ring = over_prismatic(vertices, ax * low, ay * low, ax * high, ay * high)
    x, y, angle = team.joints[link, 0], team.joints[link, 1], team.joints[link, 2]
    c, s = cos(angle), sin(angle)
    for i in range(len(ring)):
        ring[i, 0], ring[i, 1] = moved(x, y, c, s, ring[i, 0], ring[i, 1])
    return ring


@compiled
def over_piece(
    team: TeamArrays, piece: int, lower: FloatArray, upper: FloatArray, stages: int, rounded: bool
) -> FloatArray:
    """Compute a polygon that encloses a piece at every configuration of a slice, eq. (6).

    Args:
        team: The team.
        piece: Index of the piece.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        stages: Number of joints to sweep, from the piece's own; theta is the last one, and any larger number
            means all.
        rounded: Whether to grow the sweep by the piece's radius.

    Returns:
        Vertices, counter-clockwise, shape (n, 2) [m].
    """
    ring = team.vertices[team.pieces[piece, 1] : team.pieces[piece, 2]].copy()
    widest = 0.0
    link = team.pieces[piece, 0]
    while link >= 0 and stages > 0:
        axis = team.links[link, 1] - 2
        widest = max(widest, upper[axis] - lower[axis])
        ring = over_joint(team, link, ring, lower, upper)
        link, stages = team.links[link, 0], stages - 1
    return grown(ring, team.radii[piece], disc_turn(0.5 * widest)) if rounded else ring
