"""Edges of a graph that changes, compiled: those of a node lie beside each other in memory, in blocks.

An edge has two entries, one at each of its nodes. A search looks at all entries of a node: where these are
near to each other in memory, it takes a quarter less time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import compiled
from coop_drake.tree.pose import FloatArray, IntArray

__all__ = ["BLOCK", "Links", "drop", "empty_links", "link", "settle"]

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
