"""Cuts the edges of rings into pieces that are short where the opposite wall is near."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from coop_drake.geometry.distances import squared_distance
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

IndexArray = NDArray[np.intp]


@compiled
def cut_edges(
    edges: FloatArray, shortest: float, coarsest: float, per_gap: float
) -> tuple[FloatArray, IndexArray]:
    """Halve every edge until its pieces are short against their distance to the opposite wall.

    Args:
        edges: Edges (x0, y0, x1, y1) of closed rings, shape (E, 4) [m].
        shortest: Pieces of this length are not halved [m].
        coarsest: Longer pieces are halved, however far the opposite wall is [m].
        per_gap: Least number of pieces on a stretch as long as its distance to the opposite wall [-].

    Returns:
        Starts of the pieces in order, shape (n, 2) [m], and the edge of each, shape (n,).
    """
    starts = [(edges[0, 0], edges[0, 1])]
    owners = [0]
    for k in range(edges.shape[0]):
        x0, y0, dx, dy = edges[k, 0], edges[k, 1], edges[k, 2] - edges[k, 0], edges[k, 3] - edges[k, 1]
        length = sqrt(dx * dx + dy * dy)
        stack = [(0.0, 1.0)]
        while len(stack) > 0:
            s, t = stack.pop()
            gap = _gap(edges, k, x0 + 0.5 * (s + t) * dx, y0 + 0.5 * (s + t) * dy)
            if (t - s) * length > max(shortest, min(coarsest, gap / per_gap)):
                stack.append((0.5 * (s + t), t))
                stack.append((s, 0.5 * (s + t)))
            else:
                starts.append((x0 + s * dx, y0 + s * dy))
                owners.append(k)
    return np.array(starts[1:]), np.array(owners[1:])


@compiled(borrows=True)
def _gap(edges: FloatArray, k: int, x: float, y: float) -> float:
    """Distance of a point of edge k to the nearest edge that does not touch it [m]."""
    gap = np.inf
    for j in range(edges.shape[0]):
        x0, y0, x1, y1 = edges[j, 0], edges[j, 1], edges[j, 2], edges[j, 3]
        touches = False
        for end in (0, 2):
            u, v = edges[k, end], edges[k, end + 1]
            touches = touches or (x0 == u and y0 == v) or (x1 == u and y1 == v)
        if not touches:
            gap = min(gap, squared_distance(x, y, x0, y0, x1, y1))
    return sqrt(gap)
