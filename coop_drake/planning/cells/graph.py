"""Slices of the joint space, and the graph of cells of neighbouring slices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from heapq import heappop, heappush
from math import inf, pi
from typing import TYPE_CHECKING

from coop_drake.geometry.swept_tree import Interval, Intervals
from coop_drake.planning.cells.cells import Region
from coop_drake.tree.component_tree import ComponentTree, nearest_turn

if TYPE_CHECKING:
    from networkx import Graph

# Compound slices, eq. (7): boxes of intervals in (theta, q...), halved one by one, with their neighbours.
#
# Circular axes (theta, and joints without limits) have a turn of values: their first and last slices meet.

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


# The graph of cells: FREE, GUIDE and MIXED ones, joined where slices share a facet and regions meet.
#
# networkx holds the cells and the edges between regions that meet. Whether two regions meet is tested only
# when a cheaper way would use the edge: a test takes longer than many steps of the search. When cells are
# removed, only the costs of ways through them are computed again, as in other incremental searches.


class Kind(IntEnum):
    """What is known about a cell."""

    FREE = 0
    """An under-cell: all of it is free."""
    GUIDE = 1
    """The free region of a slice's middle configuration: a hint."""
    MIXED = 2
    """An over-cell: nothing outside it is free."""


@dataclass(eq=False)
class GraphCell:
    """A node of the graph: a region of positions over a slice.

    Attributes:
        index: Its number in the graph.
        slice: Id of its slice.
        kind: What is known about it.
        region: Positions p_WL.
        weight: Cost of passing through it.
    """

    index: int
    slice: int
    kind: Kind
    region: Region
    weight: float


class CellGraph:
    """Cells by slice, and an incremental search by Dijkstra's algorithm for the path of least total weight.

    It finds what a new search would. Ways to a cell may be equally cheap. Then it takes the way whose last
    cell but one costs least, and among these the one with the lowest number.

    Args:
        slices: The subdivision that the cells belong to.
    """

    def __init__(self, slices: Slices) -> None:
        import networkx as nx  # Most plans do not need it, and its import takes a tenth of a second.

        self._slices = slices
        self.cells: list[GraphCell] = []
        self.by_slice: dict[int, list[GraphCell]] = {}
        self._weights: list[float] = []
        self._graph: Graph[int] = nx.Graph()
        self._untested: dict[int, set[int]] = {}
        self._forget_all()

    def _forget_all(self) -> None:
        """Begin a search that knows nothing: least costs, cells before and after each, and open cells."""
        self._best: list[float] = [inf] * len(self.cells)
        self._before: list[int] = [-1] * len(self.cells)
        self._after: dict[int, set[int]] = {cell.index: set() for cell in self.cells}
        self._heap: list[tuple[float, int]] = []
        self._open: set[int] = set()
        self._starts: set[int] = set()
        self._reached = -1

    def add(self, index: int, members: Sequence[tuple[Kind, Region, float]]) -> None:
        """Put the cells (kind, region, weight) of a new leaf into the graph."""
        first = len(self.cells)
        made = [
            GraphCell(first + i, index, kind, region, weight)
            for i, (kind, region, weight) in enumerate(members)
        ]
        self.cells += made
        self._weights += [cell.weight for cell in made]
        self.by_slice[index] = made
        self._graph.add_nodes_from(range(first, len(self.cells)))
        beside = [cell for k in self._slices.all[index].neighbours for cell in self.by_slice.get(k, ())]
        for cell in made:
            west, south, east, north = cell.region.bounds
            near = set[int]()
            for other in beside:
                bounds = other.region.bounds
                if bounds[0] <= east and bounds[2] >= west and bounds[1] <= north and bounds[3] >= south:
                    near.add(other.index)
                    self._untested[other.index].add(cell.index)
            self._untested[cell.index], self._after[cell.index] = near, set()
            self._best.append(inf)
            self._before.append(-1)
            for k in near:
                self._reopen(k)

    def remove(self, index: int) -> None:
        """Remove the cells of a slice that is about to be halved, and forget costs of ways through them."""
        removed = [cell.index for cell in self.by_slice.pop(index)]
        for k in removed:
            for other in self._untested.pop(k):
                self._untested[other].discard(k)
        self._graph.remove_nodes_from(removed)
        self._starts.difference_update(removed)
        lost = [k for k in removed if self._best[k] < inf]
        for k in lost:  # Grows on the way: ways through lost cells are lost, too.
            self._best[k] = inf
            self._open.discard(k)
            lost += [other for other in self._after[k] if self._best[other] < inf]
        for k in lost:
            self._lead(k, -1)
        for k in removed:
            del self._after[k]
        around = set[int]()
        for k in lost:
            if k in self._graph:
                around.update(self._graph.neighbors(k), self._untested[k])
        for k in around:
            self._reopen(k)

    def cheapest(self, starts: Sequence[GraphCell], goals: set[int]) -> list[GraphCell] | None:
        """Path of least total weight; of equal costs the lower index comes first.

        Args:
            starts: Cells that hold the start.
            goals: Indices of the cells that hold the goal.

        Returns:
            Cells from a start to a goal, or None if no path joins them.
        """
        begins = {cell.index for cell in starts}
        if not self._starts <= begins:
            self._forget_all()
        self._starts = begins
        if self._reached >= 0:
            self._reopen(self._reached)
        for k in sorted(begins):
            if self._weights[k] < self._best[k]:
                self._lead(k, -1)
                self._raise(k, self._weights[k])
        self._reached = -1
        while self._heap:
            cost, k = heappop(self._heap)
            if k not in self._open or cost != self._best[k]:  # left from before its cost changed
                continue
            self._open.discard(k)
            if k in goals:
                self._reached = k
                return self._trace(k)
            self._pass(k)
        return None

    def _pass(self, k: int) -> None:
        """Take all ways over the edges of a cell that are cheaper than those known."""
        best, weights, here = self._best, self._weights, self._best[k]
        for other in self._graph.neighbors(k):
            if here + weights[other] <= best[other]:
                self._try(k, other)
        for other in [other for other in self._untested[k] if here + weights[other] <= best[other]]:
            if self._is_better(k, other):
                self._untested[k].discard(other)
                self._untested[other].discard(k)
                if self._meet(k, other):
                    self._graph.add_edge(k, other)
                    self._try(k, other)

    def _is_better(self, k: int, other: int) -> bool:
        """Whether a way from one cell to another, no dearer than the known one, takes its place."""
        last = self._before[other]
        cheaper = self._best[k] + self._weights[other] < self._best[other]
        return cheaper or (last >= 0 and (self._best[k], k) < (self._best[last], last))

    def _try(self, k: int, other: int) -> None:
        """Go from one cell to another if that is better."""
        cost = self._best[k] + self._weights[other]
        if self._is_better(k, other):
            self._lead(other, k)
            if cost < self._best[other]:
                self._raise(other, cost)

    def _lead(self, k: int, before: int) -> None:
        """Set the cell before another one, -1 for none."""
        if self._before[k] >= 0:
            self._after[self._before[k]].discard(k)
        self._before[k] = before
        if before >= 0:
            self._after[before].add(k)

    def _raise(self, k: int, cost: float) -> None:
        """Give a cell a cost, and open it."""
        self._best[k] = cost
        self._open.add(k)
        heappush(self._heap, (cost, k))

    def _reopen(self, k: int) -> None:
        """Open a cell that has a cost, if it is not open: it may lead to other cells now."""
        if self._best[k] < inf and k not in self._open:
            self._raise(k, self._best[k])

    def _meet(self, one: int, other: int) -> bool:
        """Whether the regions of two cells meet.

        If geometry fails, cells count as joined, so that nothing is called blocked wrongly; two FREE cells
        count as apart, because a path of FREE cells is a proof.
        """
        a, b = self.cells[one], self.cells[other]
        return a.region.meets(b.region, otherwise=(a.kind, b.kind) != (Kind.FREE, Kind.FREE))

    def _trace(self, index: int) -> list[GraphCell]:
        path = [index]
        while (before := self._before[path[-1]]) >= 0:
            path.append(before)
        return [self.cells[i] for i in reversed(path)]
