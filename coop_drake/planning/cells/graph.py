"""Incremental Dijkstra search on a graph that changes, compiled, with lazy tests of edges.

An edge is tested only when a cheaper way would use it: a test takes longer than many steps of the search.
When nodes are removed, only the costs of ways through them are computed again, as in other incremental
searches; all others are kept. It finds what a new search would: of equally cheap ways to a node the one
whose last node but one has the least cost, and of these the lowest number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import compiled
from coop_drake.planning.cells.graph_edges import BLOCK, Links, drop, settle
from coop_drake.tree.pose import FloatArray, IntArray

__all__ = ["NO_WAY", "REACHED", "Search", "aim", "empty_search", "forget", "go_on"]

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
