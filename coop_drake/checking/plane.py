"""Exact numbers and plane geometry: lengths and angles are integers in units of 2^-80 m and rad.

A point is a pair of integers; a convex set is the list of its hull's vertices, counter-clockwise. Only sines,
cosines, and places on a segment are rounded, with stated bounds.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from math import isqrt
from typing import Any

Point = tuple[int, int]
Edge = tuple[Point, Point]
Box = tuple[int, int, int, int]

BITS, FINE = 80, 160
"""Bits after the point of lengths, angles and factors; the same while sines and cosines are computed."""

ONE, FULL = 1 << BITS, 1 << 64
"""One metre, radian or factor; the end of a segment, whose places are integers from 0 on."""

work = [0]
"""Elementary steps that are still allowed."""


class RefusedError(Exception):
    """A statement that does not hold or was not shown: where in the documents, and what is wrong there."""

    def __init__(self, where: str, finding: str) -> None:
        self.where, self.finding = where, finding
        super().__init__(f"{where}: {finding}")


def demand(fulfilled: bool, where: str, finding: str) -> None:
    """Refuse what is not fulfilled."""
    if not fulfilled:
        raise RefusedError(where, finding)


def spend(steps: int) -> None:
    """Count elementary steps; refuse when more are needed than are allowed."""
    work[0] -= steps
    demand(work[0] >= 0, "work", "more steps are needed than are allowed: undecided")


def numbers(values: Any, count: int) -> list[int]:
    """Read so many numbers: each stands for a double, and denotes the multiple of 2^-80 nearest to it."""
    found = []
    spend(200 * count)
    demand(isinstance(values, list) and len(values) == count, "numbers", f"{values!r:.40} are not {count}")
    for value in values:
        fits = type(value) in (int, float) and -(2**20) <= value <= 2**20
        demand(fits, "number", f"{value!r:.40} is none between -2^20 and 2^20")
        above, below = value.as_integer_ratio()
        found.append((2 * above * ONE + below) // (2 * below))
    return found


def index(value: Any, count: int) -> int:
    """Read an index below a count."""
    demand(type(value) is int and 0 <= value < count, "index", f"{value!r:.40} is none below {count}")
    return int(value)


def norm(vectors: Iterable[Point]) -> int:
    """The greatest length of some vectors, rounded up."""
    return isqrt(max([x * x + y * y for x, y in vectors])) + 1


def _inverse_tangent(n: int) -> int:
    """The arc tangent of 1 / n in units of 2^-160; each of at most 70 terms is rounded by less than one."""
    return sum((-1) ** (k // 2) * ((1 << FINE) // (k * n**k)) for k in range(1, FINE, 2))


_TURN = 8 * (4 * _inverse_tangent(5) - _inverse_tangent(239))
TURN = _TURN >> (FINE - BITS)
"""2 pi by Machin's formula, wrong by less than a unit of 2^-80 (and ``_TURN`` by less than 2^-140)."""


@lru_cache(maxsize=1 << 16)
def turn(angle: int) -> Point:
    """Cosine and sine of an angle, each wrong by less than one unit.

    The angle is brought into [-pi, pi), wrong by less than 2^-119. Each term of the exponential series is
    rounded by less than a unit of 2^-160, which the factors x / n that follow enlarge to less than 24 (e^pi)
    units, and the series ends when a term vanishes: together that is far less than 2^-100.
    """
    x = ((angle << (FINE - BITS)) + _TURN // 2) % _TURN - _TURN // 2
    sums, term, n = [0, 0, 0, 0], 1 << FINE, 0
    while term not in (0, -1):
        sums[n % 4] += term
        n += 1
        term = (term * x >> FINE) // n
    half = 1 << (FINE - BITS - 1)
    return (sums[0] - sums[2] + half) >> (FINE - BITS), (sums[1] - sums[3] + half) >> (FINE - BITS)


def hull(points: Iterable[Point]) -> list[Point]:
    """Vertices of the convex hull, counter-clockwise, no three on a line (monotone chain)."""
    ordered = sorted(set(points))
    halves: list[list[Point]] = [[], []]
    for half, chain in zip(halves, (ordered, ordered[::-1]), strict=True):
        for x, y in chain:
            while len(half) > 1:
                (ax, ay), (bx, by) = half[-2:]
                if (bx - ax) * (y - ay) > (by - ay) * (x - ax):
                    break
                half.pop()
            half.append((x, y))
    return halves[0][:-1] + halves[1][:-1] if len(ordered) > 1 else ordered


def box_of(points: Sequence[Point]) -> Box:
    """The bounding box (x_min, y_min, x_max, y_max)."""
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


def boxes_apart(a: Box, b: Box, gap: int) -> bool:
    """Whether two boxes are further apart than a gap along x or along y."""
    return a[0] - b[2] > gap or b[0] - a[2] > gap or a[1] - b[3] > gap or b[1] - a[3] > gap


def sides(ring: Sequence[Point]) -> Iterable[tuple[int, int, int, int]]:
    """The first corner (x, y) of every edge of a closed ring, and the edge (u, v) as a vector."""
    pairs = zip([ring[-1], *ring], ring, strict=False) if len(ring) > 1 else ()
    return [(x, y, p - x, q - y) for (x, y), (p, q) in pairs]


def apart(first: Sequence[Point], second: Sequence[Point], gap: int) -> bool:
    """Whether two convex sets are further apart than a gap, shown by a direction along which they are.

    Tried are the normals of all edges and the direction of the nearest vertices: one attains the distance.
    """
    for one, other in ((first, second), (second, first)):
        for x, y, u, v in sides(one):
            # All of `one` lies to the left of its edge; how far is the other set to the right of it?
            most = max([u * (q - y) - v * (p - x) for p, q in other])
            if most < 0 and most * most > gap * gap * (u * u + v * v):
                return True
    _, (x, y), (p, q) = min(((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2, p, q) for p in first for q in second)
    u, v = p - x, q - y
    least = min([u * x + v * y for x, y in second]) - max([u * x + v * y for x, y in first])
    return least > 0 and least * least > gap * gap * (u * u + v * v)


def within(points: Sequence[Point], convex: Sequence[Point], depth: int) -> bool:
    """Whether points lie more than ``depth`` inside a convex polygon, or less than -depth outside."""
    if depth < 0:
        edges = list(zip([convex[-1], *convex], convex, strict=False))
        near = [any(not apart(edge, [p], -depth - 1) for edge in edges) for p in points]
        return all(close or within([p], convex, 0) for close, p in zip(near, points, strict=True))
    for x, y, u, v in sides(convex):
        least = min([u * (q - y) - v * (p - x) for p, q in points])
        if least <= 0 or least * least <= depth * depth * (u * u + v * v):
            return False
    return len(convex) > 2


class Region:
    """A closed set: all points of odd parity with respect to some rings, and the edges of these.

    Args:
        value: ``{"outer": [[x, y], ...], "holes": [[[x, y], ...], ...]}``.
    """

    def __init__(self, value: Any) -> None:
        self.rings: list[list[Point]] = []
        for ring in (value["outer"], *value["holes"]):
            self.rings.append([(x, y) for x, y in (numbers(corner, 2) for corner in ring)])
        pairs = [pair for ring in self.rings for pair in zip([ring[-1], *ring], ring, strict=False)]
        self.edges = [(p, q) for p, q in pairs if p != q]
        demand(len(self.edges) > 0, "region", "is a point")
        self.boxes = [box_of(edge) for edge in self.edges]
        self.box = box_of([point for ring in self.rings for point in ring])

    def odd(self, x: int, y: int, scale: int = 1) -> bool:
        """The parity of edges that a ray from (x, y) / scale crosses; the point is on no edge."""
        spend(len(self.edges))
        odd = False
        for (px, py), (qx, qy) in self.edges:
            if (py * scale > y) != (qy * scale > y):
                side = (qx - px) * (y - py * scale) - (qy - py) * (x - px * scale)
                odd ^= (side > 0) == (qy > py)
        return odd

    def near(self, convex: Sequence[Point], gap: int) -> bool:
        """Whether an edge is not further than a gap from a convex set."""
        spend(len(self.edges))
        box, pairs = box_of(convex), zip(self.edges, self.boxes, strict=True)
        return any(not boxes_apart(its, box, gap) and not apart(edge, convex, gap) for edge, its in pairs)

    def clear_of(self, convex: Sequence[Point], gap: int) -> bool:
        """Whether the region is further than a gap from a convex set: no edge is near, a point outside."""
        if boxes_apart(self.box, box_of(convex), gap):
            return True
        return not self.near(convex, gap) and not self.odd(*convex[0])

    def holds(self, convex: Sequence[Point], gap: int) -> bool:
        """Whether a convex set lies inside, further than a gap from all edges."""
        return not self.near(convex, gap) and self.odd(*convex[0])

    def touches(self, other: Region) -> bool:
        """Whether two regions share a point: edges meet, or a ring of one lies inside the other."""
        if boxes_apart(self.box, other.box, 0):
            return False
        corners = [(self, ring[0]) for ring in other.rings] + [(other, ring[0]) for ring in self.rings]
        return any(self.near(edge, 0) for edge in other.edges) or any(r.odd(*corner) for r, corner in corners)

    def stretches(self, edge: Sequence[Point], shift: Point, *, odd: bool) -> list[Point]:
        """Stretches of a segment, moved by ``shift``, inside (odd) or outside, rounded, without edges."""
        (ax, ay), (bx, by) = ((x + shift[0], y + shift[1]) for x, y in edge)
        dx, dy, box, cuts = bx - ax, by - ay, box_of(((ax, ay), (bx, by))), [(FULL, FULL)]
        for ((px, py), (qx, qy)), its in zip(self.edges, self.boxes, strict=True):
            first, last = dx * (py - ay) - dy * (px - ax), dx * (qy - ay) - dy * (qx - ax)
            if boxes_apart(its, box, 0) or min(first, last) > 0 or max(first, last) < 0:
                continue
            if first == last:  # On one line: all between the ends is cut out, and a point that may be on it.
                square = dx * dx + dy * dy or 1
                ends = [((x - ax) * dx + (y - ay) * dy) * FULL // square for x, y in ((px, py), (qx, qy))]
                cuts.append((min(ends) - 1, max(ends) + 2 if dx or dy else FULL + 1))
            else:
                place = ((px - ax) * (qy - py) - (py - ay) * (qx - px)) * FULL
                low, left = divmod(place, last - first)
                cuts.append((low - (left == 0), low + 1))
        spend(len(self.edges))
        found, low = [], 0
        for before, after in sorted(cuts):
            high = min(before, FULL)
            x, y = ax * FULL + dx * ((low + high) // 2), ay * FULL + dy * ((low + high) // 2)
            if low <= high and self.odd(x, y, FULL) == odd:
                found.append((low, high))
            low = max(low, after)
        return found


def stretch(edge: Sequence[Point], convex: Sequence[Point]) -> list[Point]:
    """The stretch of a segment in the interior of a convex polygon, as a list of one or none."""
    (ax, ay), (bx, by) = edge
    low, high = 0, FULL
    for x, y, u, v in sides(convex):
        at, rate = u * (ay - y) - v * (ax - x), u * (by - ay) - v * (bx - ax)
        if rate > 0:  # It is inside where at + rate * place / FULL > 0.
            low = max(low, -at * FULL // rate + 1)
        elif rate < 0:
            high = min(high, -(-at * FULL // -rate) - 1)
        elif at <= 0:
            return []
    return [(low, high)] if low <= high and len(convex) > 2 else []
