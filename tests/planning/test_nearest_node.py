"""The grid of a random tree finds the nearest node, as comparing with all nodes does."""

import numpy as np
import pytest

from coop_drake.planning.sampling.trees import add, empty_tree, nearest

LOWER, UPPER = np.array([-1.0, 2.0, -np.pi, -1.5]), np.array([9.0, 6.0, np.pi, 1.5])


@pytest.mark.parametrize("circles", [[2], [2, 3]], ids=["joint with limits", "joint without limits"])
@pytest.mark.parametrize("spread", [0.05, 1.0], ids=["crowded", "all over the floor"])
def test_the_nearest_node_is_found(spread, circles):
    random = np.random.default_rng(3)
    scale = np.array([1.0, 1.0, 1.3, 0.4])
    middle, size = 0.5 * (LOWER + UPPER), 1.2 * (UPPER - LOWER)  # Some nodes are beyond the floor.
    nodes = middle + spread * (random.random((400, 4)) - 0.5) * size
    nodes[:, circles] *= 3.0  # Circular axes are not limited to one turn.
    tree = empty_tree(len(nodes), LOWER, UPPER, np.isin(np.arange(4), circles))
    for k, z in enumerate(nodes):
        add(tree, k, z, -1)
        sample = middle + 1.3 * (random.random(4) - 0.5) * size
        d = sample - nodes[: k + 1]
        d[:, circles] -= 2.0 * np.pi * np.round(d[:, circles] / (2.0 * np.pi))
        assert nearest(tree, sample, scale) == np.argmin(((d * scale) ** 2).sum(axis=1))
