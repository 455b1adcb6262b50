"""Regions with holes, and open convex sets: which edges are near, what is inside, what crosses a segment."""

from collections.abc import Collection, Sequence
from functools import cached_property
from itertools import pairwise
from math import isqrt
from typing import Any

from coop_drake.checking.plane import (
    Bounds,
    Interval,
    Point,
    apart,
    box_of,
    boxes_apart,
    boxes_near,
    points,
    spend,
)

FULL = 1 << 64
"""The end of a segment, whose places are integers from 0 at its beginning."""

MANY = 50
"""The edges of regions with more than so many are put into the squares of a grid [-]."""


class Region:
    """Points from which a ray crosses an odd (or even) number of edges; open without the edges themselves."""

    def __init__(self, rings: list[list[Point]], *, odd: bool = True) -> None:
        self.rings, self.odd = rings, odd
        self.edges = list[tuple[Point, Point]]()
        for ring in rings:  # Corners that repeat make no edges; all the same, they are one that is a point.
            corners = [b for a, b in pairwise([ring[-1], *ring]) if a != b] or ring[:1]
            self.edges += pairwise([corners[-1], *corners])
        self.boxes = [box_of(edge) for edge in self.edges]
        self.box = box_of([corner for ring in rings for corner in ring])

    @cached_property
    def squares(self) -> tuple[int, dict[Point, list[int]]]:
        """Side of the squares of a grid, and the edges whose boxes meet each: seven times as many at most."""
        (low_x, low_y, high_x, high_y), squares = self.box, dict[Point, list[int]]()
        sizes, count = [(its[2] - its[0], its[3] - its[1]) for its in self.boxes], len(self.edges)
        area = max((high_x - low_x) * (high_y - low_y), sum(x * y for x, y in sizes))
        side = 1 + max(isqrt(area // count), sum(x + y for x, y in sizes) // count)
        for k, box in enumerate(self.boxes):
            for square in _squares(box, side):
                squares.setdefault(square, []).append(k)
        return side, squares

    def near(self, box: Bounds, gap: int) -> list[int]:
        """Edges whose boxes are not further than a gap from a box: of those in the squares that it meets."""
        seen: Collection[int] = range(len(self.edges))
        if len(self.edges) > MANY:
            (side, squares), its = self.squares, self.box
            ends = [max(box[0] - gap, its[0]), max(box[1] - gap, its[1])]
            ends += [min(box[2] + gap, its[2]), min(box[3] + gap, its[3])]
            met = _squares(ends, side)
            spend(10 + 2 * len(met))
            seen = {k for square in met for k in squares.get(square, ())}
        spend(len(seen))
        return boxes_near(self.boxes, seen, box, gap)

    def has_inside(self, x: int, y: int, scale: int = 1) -> bool:
        """Whether the point (x, y) / scale, which is on no edge, lies in the region."""
        odd, level = False, y // scale
        for k in self.near((x // scale, level, self.box[2], level), 0):
            (px, py), (qx, qy) = self.edges[k]
            if (py * scale > y) != (qy * scale > y):
                odd ^= ((qx - px) * (y - py * scale) > (qy - py) * (x - px * scale)) == (qy > py)
        return odd == self.odd

    def side(self, convex: Sequence[Point], gap: int) -> int:
        """1 if a convex set is inside, -1 if outside, by more than a gap [2^-80 m]; 0 otherwise. Exact."""
        spend(10)
        box = box_of(convex)
        if self.odd and boxes_apart(self.box, box, gap):
            return -1
        if not all(apart(self.edges[k], convex, gap) for k in self.near(box, gap)):
            return 0
        return 1 if self.has_inside(*convex[0]) else -1

    def touches(self, other: "Region") -> bool:
        """Whether two closed regions share a point: one meets an edge of the other, or lies inside it."""
        met = any(self.side(edge, 0) >= 0 for edge in other.edges)
        return met or any(other.has_inside(*ring[0]) for ring in self.rings)

    def stretches(self, segment: Sequence[Point]) -> list[Interval]:
        """Stretches of a segment in the open region: pairs of places from 0 to ``FULL``, rounded inwards."""
        ((ax, ay), (bx, by)), box, cuts = segment, box_of(segment), [(FULL, FULL)]
        dx, dy = bx - ax, by - ay
        square, after = (dx * dx + dy * dy, 2) if dx or dy else (1, FULL + 1)
        for k in self.near(box, 0):
            (px, py), (qx, qy) = self.edges[k]
            first, last = dx * (py - ay) - dy * (px - ax), dx * (qy - ay) - dy * (qx - ax)
            across = (px - ax) * (qy - py) - (py - ay) * (qx - px)
            if min(first, last) > 0 or max(first, last) < 0 or (first == last and across):
                continue
            places = [across * FULL // (last - first or 1)]
            if first == last:  # On one line: all between the edge's ends is cut out.
                places = [((x - ax) * dx + (y - ay) * dy) * FULL // square for x, y in ((px, py), (qx, qy))]
            cuts.append((min(places) - 1, max(places) + after))
        found, low = [], 0
        for before, after in sorted(cuts):
            high = min(before, FULL)
            x, y = ax * FULL + dx * ((low + high) // 2), ay * FULL + dy * ((low + high) // 2)
            if low <= high and self.has_inside(x, y, FULL):
                found.append((low, high))
            low = max(low, after)
        return found


class Convex:
    """Points to the left of all edges of a convex ring, which is counter-clockwise; open."""

    def __init__(self, corners: list[Point]) -> None:
        self.edges = [*pairwise([corners[-1], *corners])]

    def stretches(self, segment: Sequence[Point]) -> list[Interval]:
        """The stretch of a segment in the set, if there is one: places rounded inwards, as of a region."""
        ((ax, ay), (bx, by)), low, high = segment, 0, FULL
        spend(len(self.edges))
        for (px, py), (qx, qy) in self.edges:
            dx, dy = qx - px, qy - py
            first, last = dx * (ay - py) - dy * (ax - px), dx * (by - py) - dy * (bx - px)
            if first <= 0 and last <= 0:
                return []
            if first <= 0:
                low = max(low, -first * FULL // (last - first) + 2)
            elif last <= 0:
                high = min(high, first * FULL // (first - last) - 1)
        return [(low, high)] if low <= high else []


def read_region(value: Any) -> Region:
    """Read ``{"outer": [[x, y], ...], "holes": [[[x, y], ...], ...]}``."""
    return Region([points(ring) for ring in (value["outer"], *value["holes"])])


def _squares(box: Bounds, side: int) -> list[Point]:
    """Squares of a grid with a side [2^-80 m] that a box meets."""
    columns, rows = range(box[0] // side, box[2] // side + 1), range(box[1] // side, box[3] // side + 1)
    return [(column, row) for column in columns for row in rows]
