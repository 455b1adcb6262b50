"""Edges in blocks are those that a set of pairs would hold, and memory of removed ones is used again."""

from itertools import combinations

import numpy as np
import pytest

from coop_drake.planning.cells.graph import BLOCK, drop, empty_links, link, settle

NODES, GROUP = 90, 3


def entries_of(links, node):
    """Entries of a node in the order in which ``settle`` wants them."""
    entries, block, filled = [], links.head[node], links.filled[node]
    while block >= 0:
        entries += range(BLOCK * block + filled - 1, BLOCK * block - 1, -1)
        block, filled = links.following[block], BLOCK
    return np.array(entries, dtype=np.int64)


def edges_of(links):
    """All edges as pairs (lower, higher), each with whether its nodes are known to be joined."""
    found = {}
    for node in range(NODES):
        for entry in entries_of(links, node):
            other, mate = int(links.to[entry]), links.mate[entry]
            assert (links.to[mate], links.mate[mate]) == (node, entry)
            pair = min(node, other), max(node, other)
            assert found.setdefault(pair, links.joined[entry]) == links.joined[mate]
    return found


def boxes_overlap(one, other):
    return (one[:2] <= other[2:]).all() and (other[:2] <= one[2:]).all()


@pytest.fixture
def linked():
    """All nodes, added in groups, each group joined to all that came before."""
    links = empty_links(NODES, NODES * NODES)
    corners = np.random.default_rng(4).random((NODES, 2))
    links.bounds[:] = np.hstack((corners, corners + 0.3))
    for first in range(0, NODES, GROUP):
        link(links, first, first + GROUP, np.array([[0, first]]))
    return links


def test_nodes_are_joined_where_their_bounds_meet(linked):
    expected = {
        (a, b): 0
        for a, b in combinations(range(NODES), 2)
        if a // GROUP != b // GROUP and boxes_overlap(linked.bounds[a], linked.bounds[b])
    }
    assert edges_of(linked) == expected
    assert len(expected) > BLOCK * NODES / 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_what_tests_and_removals_leave_is_what_a_dictionary_would_hold(linked, seed):
    random, expected = np.random.default_rng(seed), edges_of(linked)
    for node in random.permutation(NODES)[: NODES // 2].tolist():
        if random.random() < 0.3:
            while linked.head[node] >= 0:
                drop(linked, node, int(entries_of(linked, node)[0]))
            expected = {pair: joined for pair, joined in expected.items() if node not in pair}
            assert edges_of(linked) == expected
            continue
        entries = entries_of(linked, node)
        chosen = entries[random.random(len(entries)) < 0.6]
        meet = random.random(len(chosen)) < 0.5
        pairs = [tuple(sorted((node, other))) for other in linked.to[chosen].tolist()]
        settle(linked, node, chosen, meet)
        for pair, met in zip(pairs, meet, strict=True):
            if met:
                expected[pair] = 1
            else:
                del expected[pair]
        assert edges_of(linked) == expected


def test_memory_of_removed_edges_is_used_again(linked):
    used = linked.state[1]
    for _ in range(10):
        for node in range(NODES - GROUP, NODES):
            while linked.head[node] >= 0:
                drop(linked, node, int(entries_of(linked, node)[-1]))
        link(linked, NODES - GROUP, NODES, np.array([[0, NODES - GROUP]]))
    assert linked.state[1] <= used + GROUP + NODES
