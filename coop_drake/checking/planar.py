"""Exact plane geometry: hulls, separation, regions with holes, and the stretches of a segment inside a set.

A point is a pair of integers; a convex set is its hull's vertices, counter-clockwise. Nothing rounds.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from coop_drake.checking.numbers import RefusedError, numbers, spend

Point = tuple[int, int]
Edge = tuple[Point, Point]
Box = tuple[int, int, int, int]

FULL = 1 << 64
"""Places on a segment are integers from 0 to this; stretches are rounded inwards to closed ones."""


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


def apart(first: Sequence[Point], second: Sequence[Point], gap: int) -> bool:
    """Whether two convex sets are further apart than a gap, shown by a direction along which they are.

    Tried are the normals of all edges and the direction of the nearest vertices: one attains the distance.
    """
    for one, other in ((first, second), (second, first)):
        for k in range(len(one) if len(one) > 1 else 0):
            (px, py), (qx, qy) = one[k - 1], one[k]
            ux, uy = qx - px, qy - py
            # All of `one` lies to the left of its edge; how far is the other set to the right of it?
            most = max([ux * (y - py) - uy * (x - px) for x, y in other])
            if most < 0 and most * most > gap * gap * (ux * ux + uy * uy):
                return True
    _, (px, py), (qx, qy) = min(
        ((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2, p, q) for p in first for q in second
    )
    ux, uy = qx - px, qy - py
    least = min([ux * x + uy * y for x, y in second]) - max([ux * x + uy * y for x, y in first])
    return least > 0 and least * least > gap * gap * (ux * ux + uy * uy)


def within(points: Sequence[Point], convex: Sequence[Point], depth: int) -> bool:
    """Whether points lie more than ``depth`` inside a convex polygon, or less than -depth outside."""
    if depth < 0:
        edges = [(convex[k - 1], convex[k]) for k in range(len(convex))]
        return all(
            within([p], convex, 0) or any(not apart(edge, [p], -depth - 1) for edge in edges) for p in points
        )
    for k in range(len(convex)):
        (px, py), (qx, qy) = convex[k - 1], convex[k]
        ux, uy = qx - px, qy - py
        least = min([ux * (y - py) - uy * (x - px) for x, y in points])
        if least <= 0 or least * least <= depth * depth * (ux * ux + uy * uy):
            return False
    return True


class Region:
    """A closed set with holes: all points of odd parity, and all edges of its rings, which may be any.

    Args:
        value: ``{"outer": [[x, y], ...], "holes": [[[x, y], ...], ...]}``.
    """

    def __init__(self, value: Any) -> None:
        self.rings = []
        for ring in (value["outer"], *value["holes"]):
            self.rings.append([(x, y) for x, y in (numbers(corner, 2) for corner in ring)])
        sides = [(ring[k - 1], ring[k]) for ring in self.rings for k in range(len(ring))]
        self.edges: list[Edge] = [(p, q) for p, q in sides if p != q]
        if not all(self.rings) or not self.edges:
            raise RefusedError("region", "has an empty ring, or is a point")
        self.boxes = [box_of(edge) for edge in self.edges]
        self.box = box_of([point for ring in self.rings for point in ring])

    def odd(self, x: int, y: int, scale: int = 1) -> bool:
        """The parity of edges that a ray from (x, y) / scale crosses, a point that is on no edge."""
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
        box = box_of(convex)
        pairs = zip(self.edges, self.boxes, strict=True)
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
        rings = [(self, ring[0]) for ring in other.rings] + [(other, ring[0]) for ring in self.rings]
        return any(self.near(edge, 0) for edge in other.edges) or any(r.odd(*corner) for r, corner in rings)

    def stretches(self, edge: Sequence[Point], shift: Point, *, odd: bool) -> list[tuple[int, int]]:
        """Stretches of a segment, moved by ``shift``, that lie inside (odd) or outside, without any edges."""
        (ax, ay), (bx, by) = ((x + shift[0], y + shift[1]) for x, y in edge)
        dx, dy = bx - ax, by - ay
        box, cuts = box_of(((ax, ay), (bx, by))), [(FULL, FULL)]
        for ((px, py), (qx, qy)), its in zip(self.edges, self.boxes, strict=True):
            if boxes_apart(its, box, 0):
                continue
            first, last = dx * (py - ay) - dy * (px - ax), dx * (qy - ay) - dy * (qx - ax)
            if (
                first == last == 0
            ):  # On one line: all between the ends is left out; a point that may be on it, too.
                square = dx * dx + dy * dy
                ends = [
                    ((x - ax) * dx + (y - ay) * dy) * FULL // (square or 1) for x, y in ((px, py), (qx, qy))
                ]
                cuts.append((min(ends) - 1, max(ends) + 2 if square else FULL + 1))
            elif min(first, last) <= 0 <= max(first, last):
                place = ((px - ax) * (qy - py) - (py - ay) * (qx - px)) * FULL
                low, left = divmod(place, last - first)
                cuts.append((low - (left == 0), low + 1))
        found, low = [], 0
        for before, after in sorted(cuts):
            high = min(before, FULL)
            if low <= high:
                middle = (low + high) // 2
                if self.odd(ax * FULL + dx * middle, ay * FULL + dy * middle, FULL) == odd:
                    found.append((low, high))
            low = max(low, after)
        return found


def stretch(edge: Sequence[Point], convex: Sequence[Point]) -> list[tuple[int, int]]:
    """The stretch of a segment in the interior of a convex polygon, as a list of one or none."""
    (ax, ay), (bx, by) = edge
    low, high = 0, FULL
    for k in range(len(convex)):
        (px, py), (qx, qy) = convex[k - 1], convex[k]
        ux, uy = qx - px, qy - py
        at, rate = ux * (ay - py) - uy * (ax - px), ux * (by - ay) - uy * (bx - ax)
        # It is inside where at + rate * place / FULL > 0.
        if rate > 0:
            low = max(low, -at * FULL // rate + 1)
        elif rate < 0:
            high = min(high, -(-at * FULL // -rate) - 1)
        elif at <= 0:
            return []
    return [(low, high)] if low <= high else []
