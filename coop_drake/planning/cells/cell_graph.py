"""The graph of cells: FREE, GUIDE and MIXED ones, joined where slices share a facet and regions meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import prepared
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.graph_edges import BLOCK, empty_links, link
from coop_drake.planning.cells.graph_search import NO_WAY, REACHED, aim, empty_search, forget, go_on
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
    """

    index: int
    slice: int
    kind: Kind
    region: Region
    weight: float


class CellGraph:
    """Cells by slice; edges are tested when a search first needs them.

    Args:
        slices: The subdivision that the cells belong to.
    """

    def __init__(self, slices: Slices) -> None:
        self._slices = slices
        self.cells: list[GraphCell] = []
        self.by_slice: dict[int, list[GraphCell]] = {}
        self._links, self._search = empty_links(0, 0), empty_search(0)
        self._go_on = prepared(go_on, (self._links, self._search))
        self._searched, self._starts = 0, set[int]()

    def add(self, index: int, members: Sequence[tuple[Kind, Region, float]]) -> None:
        """Put the cells (kind, region, weight) of a new leaf into the graph."""
        first = len(self.cells)
        made = [
            GraphCell(first + i, index, kind, region, weight)
            for i, (kind, region, weight) in enumerate(members)
        ]
        self.cells += made
        self.by_slice[index] = made
        if not made:
            return
        beside = [self.by_slice.get(other, ()) for other in sorted(self._slices.all[index].neighbours)]
        ranges = np.array([(its[0].index, its[-1].index + 1) for its in beside if its], dtype=np.int64)
        others, last = ranges.reshape(-1, 2), len(self.cells)
        self._make_room(last, len(made), int((others[:, 1] - others[:, 0]).sum()))
        self._links.weights[first:last] = [cell.weight for cell in made]
        self._links.bounds[first:last] = [cell.region.bounds for cell in made]
        link(self._links, first, last, others)

    def remove(self, index: int) -> None:
        """Remove the cells of a slice that is about to be halved."""
        if removed := self.by_slice.pop(index):
            first, last = removed[0].index, removed[-1].index + 1
            self._starts.difference_update(range(first, last))
            forget(self._links, self._search, first, last)

    def _make_room(self, nodes: int, new: int, others: int) -> None:
        """Let the arrays grow, to twice what is needed, where they are too small for new nodes and edges.

        Args:
            nodes: All nodes, the new ones included.
            new: New nodes.
            others: Nodes that each of these may meet.
        """
        links, room, stored = self._links, len(self._links.weights), len(self._links.following)
        blocks = int(links.state[1]) + new + others + 2 * (new * others // BLOCK)
        if nodes > room or blocks > stored:
            room = room if nodes <= room else 2 * nodes
            before: list[NDArray[Any]] = [*links, *self._search]
            self._search = empty_search(room)
            self._links = empty_links(room, stored if blocks <= stored else 2 * blocks)
            grown: list[NDArray[Any]] = [*self._links, *self._search]
            for larger, old in zip(grown, before, strict=True):
                larger[: len(old)] = old
            self._go_on = prepared(go_on, (self._links, self._search))

    def cheapest(self, starts: Sequence[GraphCell], goals: set[int]) -> list[GraphCell] | None:
        """Path of least total weight by Dijkstra's algorithm; of equal costs the lower index comes first.

        Args:
            starts: Cells that hold the start.
            goals: Indices of the cells that hold the goal.

        Returns:
            Cells from a start to a goal, or None if no path joins them.
        """
        begins = {cell.index for cell in starts}
        if not self._starts <= begins:
            self._search, self._searched = empty_search(len(self._links.weights)), 0
            self._go_on = prepared(go_on, (self._links, self._search))
        links, search = self._links, self._search
        first, last = (np.array(sorted(ends), dtype=np.int64) for ends in (begins, goals))
        aim(links, search, self._searched, first, last, len(self.cells))
        self._searched, self._starts = len(self.cells), begins
        while (asked := self._go_on()) not in (REACHED, NO_WAY):
            node, others = int(search.state[1]), links.to[search.asked[:asked]].tolist()
            search.meet[:asked] = [self._meet(node, other) for other in others]
        return None if asked == NO_WAY else self._trace(int(search.state[1]))

    def _meet(self, one: int, other: int) -> bool:
        """Whether the regions of two cells meet.

        If geometry fails, cells count as joined, so that nothing is called blocked wrongly; two FREE cells
        count as apart, because a path of FREE cells is a proof.
        """
        a, b = self.cells[one], self.cells[other]
        return a.region.meets(b.region, otherwise=(a.kind, b.kind) != (Kind.FREE, Kind.FREE))

    def _trace(self, index: int) -> list[GraphCell]:
        path = [index]
        while (before := int(self._search.back[path[-1]])) >= 0:
            path.append(before)
        return [self.cells[i] for i in reversed(path)]
