"""Incremental Dijkstra search on a graph that changes, compiled, with lazy tests of edges.

An edge is tested only when a cheaper way would use it: a test takes longer than many steps of the search.
When nodes are removed, only the costs of ways through them are computed again, as in other incremental
searches; all others are kept. It finds what a new search would: of equally cheap ways to a node the one
whose last node but one has the least cost, and of these the lowest number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.tree.pose import FloatArray, IntArray

__all__ = ["NO_WAY", "REACHED", "Links", "Search", "aim", "forget", "go_on", "link"]

REACHED, NO_WAY = -1, -2
"""How a search ends: at a goal, or with nothing left to search."""

_UNTESTED, _APART, _JOINED = -1, 0, 1
"""What is known about an edge; searches leave out those whose nodes are apart or were removed."""


class Links(NamedTuple):
    """Nodes and edges. Edges 2 k and 2 k + 1 are the two directions of edge k.

    Attributes:
        weights: Cost of passing through each node, shape (N,).
        bounds: (x_min, y_min, x_max, y_max) of each node's region, shape (N, 4) [m].
        head: First edge that leaves each node, -1 if there is none, shape (N,).
        following: The next edge that leaves the same node, -1 after the last, shape (2 E,).
        to: The node that an edge leads to, shape (2 E,).
        met: 1 where the regions of an edge's nodes meet, 0 where they do not or one was removed, -1 if
            untested, shape (E,).
    """

    weights: FloatArray
    bounds: FloatArray
    head: IntArray
    following: IntArray
    to: IntArray
    met: IntArray


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
        asked: Edges that have to be tested, shape (A,).
        state: How many nodes are open, and the node whose edges are looked at, -1 if none is, shape (2,).
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
    state: IntArray


@compiled
def link(links: Links, first: int, last: int, others: IntArray, count: int) -> int:
    """Join nodes to those of some ranges whose bounds meet theirs, by untested edges.

    Args:
        links: The graph, with room for the edges.
        first: The first node.
        last: The node after the last one.
        others: Ranges of nodes, each its first and the one after its last, shape (R, 2).
        count: Edges so far, both directions counted.

    Returns:
        Edges now.
    """
    for node in range(first, last):
        west, south, east, north = links.bounds[node]
        for row in range(len(others)):
            for other in range(others[row, 0], others[row, 1]):
                its = links.bounds[other]
                if its[0] > east or its[2] < west or its[1] > north or its[3] < south:
                    continue
                links.met[count // 2] = _UNTESTED
                for start, end in ((node, other), (other, node)):
                    links.to[count], links.following[count] = end, links.head[start]
                    links.head[start] = count
                    count += 1
    return count


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
    """Let all nodes beside a node that have a cost wait: they may lead to it."""
    edge = links.head[node]
    while edge >= 0:
        other = links.to[edge]
        if links.met[edge // 2] != _APART and search.best[other] < np.inf:
            _raise(search, other, search.best[other])
        edge = links.following[edge]


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
        edge = links.head[node]
        while edge >= 0:
            links.met[edge // 2] = _APART
            edge = links.following[edge]
        links.head[node] = -1
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
    search.state[1] = -1
    for node in range(new, count):
        _beside(links, search, node)
    for node in starts:
        if links.weights[node] < search.best[node]:
            _lead(search, node, -1)
            _raise(search, node, links.weights[node])


@compiled
def go_on(links: Links, search: Search) -> int:
    """Search until there is an answer or edges have to be tested.

    Returns:
        How many of ``asked`` have to be tested first, ``REACHED`` with the goal in ``state[1]``, or
        ``NO_WAY``.
    """
    while search.state[0] > 0 or search.state[1] >= 0:
        if search.state[1] < 0:
            search.state[1] = search.heap[0]
            _take(search, search.state[1])
            if search.goal[search.state[1]] == 1:
                return REACHED
        node = search.state[1]
        unknown = 0
        before, edge = -1, links.head[node]
        while edge >= 0 and unknown < len(search.asked):
            met, after = links.met[edge // 2], links.following[edge]
            if met == _APART:
                if before < 0:
                    links.head[node] = after
                else:
                    links.following[before] = after
            else:
                other = links.to[edge]
                cost, last = search.best[node] + links.weights[other], search.back[other]
                cheaper = cost < search.best[other]
                if cheaper or (cost == search.best[other] and last >= 0 and _before(search, node, last)):
                    if met == _UNTESTED:
                        search.asked[unknown] = edge
                        unknown += 1
                    elif met == _JOINED:
                        _lead(search, other, node)
                        if cheaper:
                            _raise(search, other, cost)
                before = edge
            edge = after
        if unknown > 0:
            return unknown
        search.state[1] = -1
    return NO_WAY
