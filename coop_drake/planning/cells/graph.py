"""The graph of cells: FREE, GUIDE and MIXED ones, joined where slices share a facet and regions meet.

networkx holds the cells and the edges between regions that meet. Whether two regions meet is tested only
when a cheaper way would use the edge: a test takes longer than many steps of the search. When cells are
removed, only the costs of ways through them are computed again, as in other incremental searches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from heapq import heappop, heappush
from math import inf
from typing import TYPE_CHECKING

from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.slices import Slices

if TYPE_CHECKING:
    from networkx import Graph


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

    It finds what a new search would: of equally cheap ways to a cell the one whose last cell but one has the
    least cost, and of these the lowest number.

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
