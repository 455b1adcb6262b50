"""Whether cells and blocked positions cover the plane; only boundaries are looked at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from coop_drake.checking.plane import (
    FULL,
    ONE,
    Edge,
    Point,
    Region,
    box_of,
    boxes_apart,
    demand,
    hull,
    spend,
    stretch,
    within,
)  # fmt: skip


class OpenSet(NamedTuple):
    """The interior of a convex ring; or the inside (odd) or outside of a region that is moved by -shift."""

    ring: list[Point]
    region: Region | None = None
    shift: Point = (0, 0)
    odd: bool = True

    def edges(self) -> list[Edge]:
        """The edges that its boundary consists of."""
        if self.region is None:
            return list(zip([self.ring[-1], *self.ring], self.ring, strict=False))
        u, v = self.shift
        return [((px - u, py - v), (qx - u, qy - v)) for (px, py), (qx, qy) in self.region.edges]

    def stretches(self, edge: Edge) -> list[Point]:
        """Stretches of a segment that lie in it, rounded inwards."""
        if self.region is None:
            return stretch(edge, self.ring)
        return self.region.stretches(edge, self.shift, odd=self.odd)


def blocked(floor: Region, ring: list[Point]) -> list[OpenSet]:
    """Open sets of positions p that a polygon K forbids which bodies hold in their interior, relative to p.

    The first one holds all p for which a point inside K is off the floor. For each wall e, p + K meets it
    in the interior of the Minkowski sum of e and -K.
    """
    shift = sum(x for x, _ in ring) // len(ring), sum(y for _, y in ring) // len(ring)
    spend(300 * len(floor.edges))
    demand(within([shift], ring, 0), "inner_sweeps", "have a polygon that has almost no area")
    sums = [hull((ex - x, ey - y) for ex, ey in edge for x, y in ring) for edge in floor.edges]
    return [OpenSet([], floor, shift, odd=False), *map(OpenSet, sums)]


def check_cover(cells: Sequence[Region], forbidden: Sequence[OpenSet], where: str) -> int:
    """Check that the interiors of cells and forbidden sets cover the plane; counts their edges.

    The union of some open sets is open. If each point of each of their boundaries lies in one of them, it is
    closed as well, thus the whole plane. All cells belong to these sets; a forbidden one does as soon as it
    covers a part of a boundary.
    """
    demand(len(cells) + len(forbidden) > 0, where, "has neither cells nor inner sweeps")
    sets = [*[OpenSet([], cell) for cell in cells], *forbidden]
    taken = set(range(max(len(cells), 1)))
    boxes = [box_of(s.ring) if s.region is None else s.region.box if s.odd else None for s in sets]
    left, count = [edge for k in taken for edge in sets[k].edges()], 0
    while left:
        edge, count = left.pop(), count + 1
        box = box_of(edge)
        spend(len(sets))
        near = [k for k, its in enumerate(boxes) if its is None or not boxes_apart(its, box, 0)]
        first = [k for k in near if k in taken]
        chosen = _chosen(sets, first, edge) or _chosen(
            sets, [*first, *[k for k in near if k not in taken]], edge
        )
        x, y = edge[0]
        demand(bool(chosen), where, f"no cell covers ({x / ONE:.6f}, {y / ONE:.6f}), which may be free")
        left += [edge for k in chosen - taken for edge in sets[k].edges()]
        taken |= chosen
    return count


def _chosen(sets: Sequence[OpenSet], order: Sequence[int], edge: Edge) -> set[int]:
    """Sets whose stretches together cover an edge, early ones in the order preferred; none if they do not."""
    found = []
    for rank, k in enumerate(order):
        for low, high in sets[k].stretches(edge):
            if low == 0 and high == FULL:
                return {k}
            found.append((low, high, -rank, k))
    chosen, at = set[int](), -1
    while at < FULL:
        high, _, k = max([entry[1:] for entry in found if entry[0] <= max(at, 0)], default=(-1, 0, 0))
        if high <= at:
            return set()
        chosen.add(k)
        at = high
    return chosen
