"""Compound slices, eq. (7): boxes of intervals in (theta, q...), halved one by one, with their neighbours.

Circular axes (theta, and joints without limits) have a turn of values: their first and last slices meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import pi

from coop_drake.geometry.swept_tree import Interval, Intervals
from coop_drake.tree.component_tree import ComponentTree, nearest_turn

TOUCH = 1e-9
"""Intervals that overlap or miss each other by no more than this touch [rad or m]: it absorbs rounding."""

FIRST_THETA_SLICES = 4
"""Slices of theta at the beginning: with fewer, two slices would touch at both ends of their intervals."""


@dataclass
class Slice:
    """One compound slice; a leaf of the subdivision while ``halves`` is None.

    Attributes:
        intervals: Nominal interval of every axis (theta, q...).
        depth: Number of halvings that led to it.
        neighbours: Ids of the leaves that share a facet with it.
        halves: Ids of the two slices that replaced it, None for a leaf.
    """

    intervals: Intervals
    depth: int
    neighbours: set[int] = field(default_factory=set)
    halves: tuple[int, int] | None = None


class Slices:
    """A cover of all angles by slices, each split on its own.

    The first four slices of theta are centred at 0, pi/2, pi and 3 pi/2, because the team often moves along
    walls that are parallel to the axes: these angles then lie inside slices, not between them. A joint that
    is a circle begins with one slice, from -pi to pi.

    Args:
        tree: Gives the joints' limits, and which of them are circles.
        overlap: Overlap of neighbours as a fraction of their width, used for under-cells only.
        printed: Whether to begin with one slice of everything, and to call slices neighbours that share only
            a corner or an edge, as the paper does.
    """

    def __init__(self, tree: ComponentTree, overlap: float, *, printed: bool = False) -> None:
        self._overlap, self._printed = overlap, printed
        self._limits, self.circular = tuple((j.lower, j.upper) for j in tree.joints), tree.circular
        ranges = tuple(joint.range for joint in tree.joints)
        self.axis_widths = (2.0 * pi, *(upper - lower for lower, upper in ranges))
        count = 1 if printed else FIRST_THETA_SLICES
        part = 2.0 * pi / count
        self.all: list[Slice] = [
            Slice((((i - 0.5) * part, (i + 0.5) * part), *ranges), 0) for i in range(count)
        ]
        for i in range(count):
            self.all[i].neighbours |= {(i - 1) % count, (i + 1) % count} - {i}

    def leaves(self) -> list[int]:
        """Ids of all leaves in ascending order."""
        return [i for i, part in enumerate(self.all) if part.halves is None]

    def split(self, index: int, axis: int) -> tuple[int, int]:
        """Halve a leaf along an axis; returns the ids of its halves."""
        parent = self.all[index]
        ids = len(self.all), len(self.all) + 1
        self.all += [Slice(half, parent.depth + 1) for half in halves(parent.intervals, axis)]
        parent.halves = ids
        self.all[ids[0]].neighbours.add(ids[1])
        self.all[ids[1]].neighbours.add(ids[0])
        for other in parent.neighbours:
            self.all[other].neighbours.discard(index)
            for half in ids:
                if self._adjacent(self.all[half].intervals, self.all[other].intervals):
                    self.all[half].neighbours.add(other)
                    self.all[other].neighbours.add(half)
        parent.neighbours = set()
        return ids

    def _adjacent(self, first: Intervals, second: Intervals) -> bool:
        touches = _touches(first, second, self.circular)
        return touches is not None and (self._printed or touches <= 1)

    def expanded(self, intervals: Intervals) -> Intervals:
        """Intervals grown by the overlap of under-cells; those of joints are clipped at the joint limits."""
        growth = 0.5 * self._overlap
        grown = [(a - growth * (b - a), b + growth * (b - a)) for a, b in intervals]
        clipped = [
            (max(a, lower), min(b, upper))
            for (a, b), (lower, upper) in zip(grown[1:], self._limits, strict=True)
        ]
        return (grown[0], *clipped)

    def meeting(self, box: Intervals) -> list[int]:
        """Leaves whose closed nominal intervals share a point with a box of (theta, q...)."""
        return [i for i in self.leaves() if meets(self.all[i].intervals, box, self.circular)]

    def holding(self, angles: Sequence[float | None]) -> list[int]:
        """Leaves whose closed nominal intervals hold the angles (theta, q...); None is not tested."""
        return [i for i in self.leaves() if holds(self.all[i].intervals, angles, self.circular)]


def halves(intervals: Intervals, axis: int) -> tuple[Intervals, Intervals]:
    """Both halves of a slice along an axis, the lower one first."""
    lower, upper = intervals[axis]
    middle = 0.5 * (lower + upper)
    before, after = intervals[:axis], intervals[axis + 1 :]
    return (*before, (lower, middle), *after), (*before, (middle, upper), *after)


def holds(intervals: Intervals, angles: Sequence[float | None], circular: Sequence[bool]) -> bool:
    """Whether intervals hold (theta, q...), on circular axes modulo 2 pi; an angle None is not tested."""
    for angle, (lower, upper), periodic in zip(angles, intervals, circular, strict=True):
        if angle is None:
            continue
        centre, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
        offset = nearest_turn(angle - centre) if periodic else angle - centre
        if abs(offset) > half + TOUCH:
            return False
    return True


def meets(first: Intervals, second: Intervals, circular: Sequence[bool]) -> bool:
    """Whether two boxes of (theta, q...) share a point, on circular axes modulo 2 pi."""
    return _touches(first, second, circular) is not None


def interval_overlap(first: Interval, second: Interval, periodic: bool = False) -> float:
    """Length of the overlap of two intervals, negative for a gap [rad or m].

    Args:
        first: One interval.
        second: The other interval.
        periodic: Whether they are intervals of a circular axis, modulo 2 pi.
    """
    halves = 0.5 * (first[1] - first[0] + second[1] - second[0])
    offset = 0.5 * (first[0] + first[1] - second[0] - second[1])
    return halves - abs(nearest_turn(offset) if periodic else offset)


def share_facet(first: Intervals, second: Intervals, circular: Sequence[bool]) -> bool:
    """Whether two boxes share a facet: they overlap in all axes but at most one, in which they touch.

    Intervals of circular axes, whatever their widths, touch or overlap in any of the places that whole turns
    lead to.
    """
    touches = _touches(first, second, circular)
    return touches is not None and touches <= 1


def _touches(first: Intervals, second: Intervals, circular: Sequence[bool]) -> int | None:
    """Number of axes in which two boxes touch without overlap; None if there is a gap in some axis."""
    touches = 0
    for a, b, periodic in zip(first, second, circular, strict=True):
        shared = interval_overlap(a, b, periodic)
        if shared < -TOUCH:
            return None
        touches += shared <= TOUCH
    return touches
