"""The graph of cells: FREE, GUIDE and MIXED ones, joined where slices share a facet and regions meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import compiled, prepared
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.slices import Slices
from coop_drake.tree.pose import FloatArray, IntArray

# Edges of a graph that changes, compiled: those of a node lie beside each other in memory, in blocks.
#
# An edge has two entries, one at each of its nodes. A search looks at all entries of a node: where these
# are near to each other in memory, it takes a quarter less time.

BLOCK = 16
"""Entries of a block: as many 32-bit numbers as a line of a processor's cache holds."""


class Links(NamedTuple):
    """Nodes and edges, with room for N nodes and B blocks of entries.

    Attributes:
        weights: Cost of passing through each node, shape (N,).
        bounds: (x_min, y_min, x_max, y_max) of each node's region, shape (N, 4) [m].
        head: First block of each node's entries, -1 if there is none, shape (N,).
        filled: Entries in that block; the node's other blocks are full; shape (N,).
        following: The next block of the same node, or of the free blocks; -1 after the last; shape (B,).
        to: The node that an entry leads to, shape (BLOCK B,).
        mate: The other entry of the same edge, shape (BLOCK B,).
        joined: 1 where the regions of an edge's nodes meet, 0 if that is untested, shape (BLOCK B,).
        state: The first free block, -1 if there is none, and how many blocks were ever used, shape (2,).
    """

    weights: FloatArray
    bounds: FloatArray
    head: IntArray
    filled: IntArray
    following: IntArray
    to: NDArray[np.int32]
    mate: NDArray[np.int32]
    joined: NDArray[np.int8]
    state: IntArray


def empty_links(nodes: int, blocks: int) -> Links:
    """Arrays for so many nodes and blocks."""
    to, mate = (np.zeros(blocks * BLOCK, np.int32) for _ in range(2))
    head, filled, following = np.full(nodes, -1), np.zeros(nodes, np.int64), np.full(blocks, -1)
    joined, state = np.zeros(blocks * BLOCK, np.int8), np.array([-1, 0])
    return Links(np.zeros(nodes), np.zeros((nodes, 4)), head, filled, following, to, mate, joined, state)


@compiled
def _append(links: Links, node: int, other: int) -> int:
    """Append an untested entry to those of a node; returns where."""
    block = links.head[node]
    if block < 0 or links.filled[node] == BLOCK:
        block = links.state[0]
        if block >= 0:
            links.state[0] = links.following[block]
        else:
            block = links.state[1]
            links.state[1] += 1
        links.following[block], links.head[node], links.filled[node] = links.head[node], block, 0
    entry = int(BLOCK * block + links.filled[node])
    links.to[entry], links.joined[entry] = other, 0
    links.filled[node] += 1
    return entry


@compiled
def _remove(links: Links, node: int, entry: int) -> None:
    """Remove an entry of a node; the last one of its first block comes to its place."""
    block = links.head[node]
    links.filled[node] -= 1
    last = BLOCK * block + links.filled[node]
    if last != entry:
        mate = links.mate[last]
        links.to[entry], links.mate[entry] = links.to[last], mate
        links.joined[entry], links.mate[mate] = links.joined[last], entry
    if links.filled[node] == 0:
        links.head[node], links.filled[node] = links.following[block], BLOCK
        links.following[block], links.state[0] = links.state[0], block


@compiled
def drop(links: Links, node: int, entry: int) -> None:
    """Remove an edge that a node has an entry of."""
    _remove(links, links.to[entry], links.mate[entry])
    _remove(links, node, entry)


@compiled
def link(links: Links, first: int, last: int, others: IntArray) -> None:
    """Join nodes to those of some ranges whose bounds meet theirs, by untested edges.

    Args:
        links: The graph, with room for the edges.
        first: The first node.
        last: The node after the last one.
        others: Ranges of nodes, each its first and the one after its last, shape (R, 2).
    """
    for node in range(first, last):
        west, south, east, north = links.bounds[node]
        for row in range(len(others)):
            for other in range(others[row, 0], others[row, 1]):
                its = links.bounds[other]
                if its[0] > east or its[2] < west or its[1] > north or its[3] < south:
                    continue
                here, there = _append(links, node, other), _append(links, other, node)
                links.mate[here], links.mate[there] = there, here


@compiled
def settle(links: Links, node: int, entries: IntArray, meet: NDArray[np.bool_]) -> None:
    """Note which of some edges of a node join regions that meet, and remove the others.

    Args:
        links: The graph.
        node: The node.
        entries: Its entries, block by block, of every block the last one first, shape (k,): entries that
            move to the places of removed ones have then been looked at.
        meet: Whether the regions meet, shape (k,) or longer.
    """
    for k in range(len(entries)):
        entry = entries[k]
        if meet[k]:
            links.joined[entry] = links.joined[links.mate[entry]] = 1
        else:
            drop(links, node, entry)


# Incremental Dijkstra search on a graph that changes, compiled, with lazy tests of edges.
#
# An edge is tested only when a cheaper way would use it: a test takes longer than many steps of the search.
# When nodes are removed, only the costs of ways through them are computed again, as in other incremental
# searches; all others are kept. It finds what a new search would: of equally cheap ways to a node the one
# whose last node but one has the least cost, and of these the lowest number.

REACHED, NO_WAY = -1, -2
"""How a search ends: at a goal, or with nothing left to search."""

_ASKED = 256
"""Edges that are tested before a search goes on, at most [-]."""


class Search(NamedTuple):
    """The state of a search; a node's place in the heap is -1 where it is in none.

    Attributes:
        best: Least cost known of each node, infinite where there is none, shape (N,).
        back: The node before it, -1 for none, shape (N,).
        onward: The first of its successors, the nodes that it is ``back`` of, -1 for none, shape (N,).
        beside: The next and the last node in the list of successors it is in, -1 for none, shape (N, 2).
        heap: Open nodes, the one of least cost first, of equal ones the lowest; shape (N,).
        place: Place of each node in the heap, shape (N,).
        goal: 1 for goals, shape (N,).
        lost: Memory for the nodes whose costs are forgotten, shape (N,).
        asked: Entries of edges that have to be tested, all of one node, as ``settle`` wants them, shape (A,).
        meet: Whether the regions of each of these meet, to be written before a search goes on, shape (A,).
        state: How many nodes are open; the node whose edges are looked at, -1 if none is; and how many of
            these were asked for; shape (3,).
    """

    best: FloatArray
    back: IntArray
    onward: IntArray
    beside: IntArray
    heap: IntArray
    place: IntArray
    goal: IntArray
    lost: IntArray
    asked: IntArray
    meet: NDArray[np.bool_]
    state: IntArray


def empty_search(nodes: int) -> Search:
    """A search that has not begun, for so many nodes."""
    back, onward, heap, place, goal, lost = (np.full(nodes, -1) for _ in range(6))
    beside, asked, meet = np.full((nodes, 2), -1), np.zeros(_ASKED, np.int64), np.zeros(_ASKED, np.bool_)
    best, state = np.full(nodes, np.inf), np.array([0, -1, 0])
    return Search(best, back, onward, beside, heap, place, goal, lost, asked, meet, state)


@compiled
def _before(search: Search, one: int, other: int) -> bool:
    a, b = search.best[one], search.best[other]
    return bool(a < b or (a == b and one < other))


@compiled
def _sift_up(search: Search, node: int, at: int) -> None:
    """Put an open node into the heap, at a place or nearer to the top."""
    heap, place = search.heap, search.place
    while at > 0 and _before(search, node, heap[(at - 1) // 2]):
        heap[at] = heap[(at - 1) // 2]
        place[heap[at]] = at
        at = (at - 1) // 2
    heap[at], place[node] = node, at


@compiled
def _raise(search: Search, node: int, cost: float) -> None:
    """Give a node a lower cost, and put it into the heap of open nodes."""
    at = search.place[node]
    search.best[node] = cost
    if at < 0:
        at = search.state[0]
        search.state[0] += 1
    _sift_up(search, node, at)


@compiled
def _take(search: Search, taken: int) -> None:
    """Take an open node out of the heap; the last one comes to its place."""
    heap, place = search.heap, search.place
    at = place[taken]
    place[taken] = -1
    search.state[0] -= 1
    size = search.state[0]
    node = heap[size]
    if node == taken:
        return
    while 2 * at + 1 < size:
        child = 2 * at + 1
        if child + 1 < size and _before(search, heap[child + 1], heap[child]):
            child += 1
        if not _before(search, heap[child], node):
            break
        heap[at] = heap[child]
        place[heap[at]] = at
        at = child
    _sift_up(search, node, at)


@compiled
def _lead(search: Search, node: int, last: int) -> None:
    """Set the predecessor of a node, -1 for none, and keep the lists of successors."""
    old, (following, before) = search.back[node], search.beside[node]
    if old >= 0:
        if before >= 0:
            search.beside[before, 0] = following
        else:
            search.onward[old] = following
        if following >= 0:
            search.beside[following, 1] = before
    search.back[node] = last
    search.beside[node, 0] = search.beside[node, 1] = -1
    if last >= 0:
        first = search.onward[last]
        search.beside[node, 0] = first
        search.onward[last] = node
        if first >= 0:
            search.beside[first, 1] = node


@compiled
def _beside(links: Links, search: Search, node: int) -> None:
    """Open all nodes beside a node that have a cost: they may lead to it."""
    block, count = links.head[node], links.filled[node]
    while block >= 0:
        for entry in range(BLOCK * block, BLOCK * block + count):
            other = links.to[entry]
            if search.place[other] < 0 and search.best[other] < np.inf:
                _raise(search, other, search.best[other])
        block, count = links.following[block], BLOCK


@compiled
def _lose(search: Search, node: int, count: int) -> int:
    """Forget the cost of a node, and append it to the ``count`` lost ones; returns how many there are."""
    if search.best[node] == np.inf:
        return count
    if search.place[node] >= 0:
        _take(search, node)
    search.best[node], search.lost[count] = np.inf, node
    return count + 1


@compiled
def forget(links: Links, search: Search, first: int, last: int) -> None:
    """Remove some nodes with their edges, and forget costs of ways through them."""
    lost = 0
    for node in range(first, last):
        while links.head[node] >= 0:
            drop(links, node, BLOCK * links.head[node] + links.filled[node] - 1)
        lost = _lose(search, node, lost)
    k = 0
    while k < lost:
        node = search.onward[search.lost[k]]
        while node >= 0:
            lost = _lose(search, node, lost)
            node = search.beside[node, 0]
        k += 1
    for k in range(lost):
        _lead(search, search.lost[k], -1)
    for k in range(lost):
        _beside(links, search, search.lost[k])


@compiled
def aim(links: Links, search: Search, new: int, starts: IntArray, goals: IntArray, count: int) -> None:
    """Prepare a search of the first ``count`` nodes.

    Args:
        links: The graph.
        search: The state of the last search.
        new: Nodes from this one on were added since.
        starts: All nodes to begin at; those of the last search that were not removed are among them.
        goals: Nodes to end at.
        count: Nodes so far.
    """
    search.goal[:count] = 0
    search.goal[goals] = 1
    reached = search.state[1]
    if reached >= 0 and search.best[reached] < np.inf:
        _raise(search, reached, search.best[reached])
    search.state[1], search.state[2] = -1, 0
    for node in range(new, count):
        _beside(links, search, node)
    for node in starts:
        if links.weights[node] < search.best[node]:
            _lead(search, node, -1)
            _raise(search, node, links.weights[node])


@compiled
def _ask(links: Links, search: Search, node: int) -> int:
    """Take all cheaper ways over known edges of a node, and gather untested edges that might be cheaper.

    Returns:
        How many edges have to be tested.
    """
    unknown, here = 0, search.best[node]
    block, count = links.head[node], links.filled[node]
    while block >= 0:
        for entry in range(BLOCK * block + count - 1, BLOCK * block - 1, -1):
            other = links.to[entry]
            cost, known = here + links.weights[other], search.best[other]
            if cost > known:
                continue
            last = search.back[other]
            if cost == known and (last < 0 or not _before(search, node, last)):
                continue
            if links.joined[entry] == 0:
                search.asked[unknown] = entry
                unknown += 1
                if unknown == len(search.asked):
                    return unknown
            else:
                _lead(search, other, node)
                if cost < known:
                    _raise(search, other, cost)
        block, count = links.following[block], BLOCK
    return unknown


@compiled
def go_on(links: Links, search: Search) -> int:
    """Settle the edges that were tested, and search until there is an answer or others have to be tested.

    Returns:
        How many of ``asked`` have to be tested first, ``REACHED`` with the goal in ``state[1]``, or
        ``NO_WAY``.
    """
    settle(links, search.state[1], search.asked[: search.state[2]], search.meet)
    search.state[2] = 0
    while search.state[0] > 0 or search.state[1] >= 0:
        if search.state[1] < 0:
            search.state[1] = search.heap[0]
            _take(search, search.state[1])
            if search.goal[search.state[1]] == 1:
                return REACHED
        search.state[2] = _ask(links, search, search.state[1])
        if search.state[2] > 0:
            return int(search.state[2])
        search.state[1] = -1
    return NO_WAY


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
