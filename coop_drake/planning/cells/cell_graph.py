"""The graph of cells: FREE, GUIDE and MIXED ones, joined where slices share a facet and regions meet."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from math import inf

from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.slices import Slices


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
        beside: Cells of neighbouring slices whose bounds meet this cell's; None until a search needs them.
        tested: For the cells that a search has tested, by index, whether their regions meet this one's.
    """

    index: int
    slice: int
    kind: Kind
    region: Region
    weight: float
    beside: list[GraphCell] | None = None
    tested: dict[int, bool] = field(default_factory=dict)


class CellGraph:
    """Cells by slice; edges are tested when a search first needs them.

    Args:
        slices: The subdivision that the cells belong to.
    """

    def __init__(self, slices: Slices) -> None:
        self._slices = slices
        self.cells: list[GraphCell] = []
        self.by_slice: dict[int, list[GraphCell]] = {}

    def add(self, index: int, members: Sequence[tuple[Kind, Region, float]]) -> None:
        """Put the cells (kind, region, weight) of a new leaf into the graph."""
        self._unsettle(index)
        first = len(self.cells)
        made = [
            GraphCell(first + i, index, kind, region, weight)
            for i, (kind, region, weight) in enumerate(members)
        ]
        self.cells += made
        self.by_slice[index] = made

    def remove(self, index: int) -> None:
        """Remove the cells of a slice that is about to be halved."""
        self._unsettle(index)
        for cell in self.by_slice.pop(index):
            for other in cell.tested:
                self.cells[other].tested.pop(cell.index, None)
            cell.beside, cell.tested = None, {}

    def _unsettle(self, index: int) -> None:
        """Discard the neighbour lists of the cells around a slice, which changes."""
        for other in self._slices.all[index].neighbours:
            for cell in self.by_slice.get(other, ()):
                cell.beside = None

    def neighbours(self, cell: GraphCell) -> list[GraphCell]:
        """Cells of neighbouring slices whose regions meet this one's, in a fixed order."""
        return [other for other in self._beside(cell) if self._meet(cell, other)]

    def _beside(self, cell: GraphCell) -> list[GraphCell]:
        if cell.beside is None:
            west, south, east, north = cell.region.bounds
            cell.beside = [
                other
                for index in sorted(self._slices.all[cell.slice].neighbours)
                for other in self.by_slice[index]
                if (bounds := other.region.bounds)[0] <= east
                and bounds[2] >= west
                and bounds[1] <= north
                and bounds[3] >= south
            ]
        return cell.beside

    @staticmethod
    def _meet(cell: GraphCell, other: GraphCell) -> bool:
        meets = cell.tested.get(other.index)
        if meets is None:
            # If geometry fails, cells count as joined, so that nothing is called blocked wrongly; two FREE
            # cells count as apart, because a path of FREE cells is a proof.
            meets = cell.region.meets(
                other.region, otherwise=(cell.kind, other.kind) != (Kind.FREE, Kind.FREE)
            )
            cell.tested[other.index] = other.tested[cell.index] = meets
        return meets

    def cheapest(self, starts: Sequence[GraphCell], goals: set[int]) -> list[GraphCell] | None:
        """Path of least total weight by Dijkstra's algorithm; of equal costs the lower index comes first.

        Args:
            starts: Cells that hold the start.
            goals: Indices of the cells that hold the goal.

        Returns:
            Cells from a start to a goal, or None if no path joins them.
        """
        best = {cell.index: cell.weight for cell in starts}
        back: dict[int, int] = {}
        queue = [(cost, index) for index, cost in best.items()]
        heapq.heapify(queue)
        while queue:
            cost, index = heapq.heappop(queue)
            if cost > best[index]:
                continue
            if index in goals:
                return self._trace(back, index)
            cell = self.cells[index]
            for other in self._beside(cell):
                through = cost + other.weight
                if through < best.get(other.index, inf) and self._meet(cell, other):
                    best[other.index], back[other.index] = through, index
                    heapq.heappush(queue, (through, other.index))
        return None

    def _trace(self, back: dict[int, int], index: int) -> list[GraphCell]:
        path = [index]
        while path[-1] in back:
            path.append(back[path[-1]])
        return [self.cells[i] for i in reversed(path)]
