"""Compiled Minkowski sums of wall edges with a convex polygon."""

from __future__ import annotations

import numba
import numpy as np

from coop_drake.geometry.pose import FloatArray


@numba.njit(cache=True)
def edge_sums(edges: FloatArray, convex: FloatArray) -> FloatArray:
    """Sums of every edge with a convex ring, clockwise.

    Vertices between two sides that lead the same way along e shift to the same end of e; at the two others
    the ring opens and takes e in. Repeated vertices fill up shorter rings, and do no harm.

    Args:
        edges: Edges (x0, y0, x1, y1), shape (E, 4) [m].
        convex: Convex ring, counter-clockwise, shape (n, 2) [m].

    Returns:
        Rings, shape (E, m, 2), m = n + 2 unless sides are nearly parallel to edges [m].
    """
    count = len(convex)
    sums = np.empty((len(edges), 2 * count, 2))
    first = np.empty(len(edges), dtype=np.int64)
    for e in range(len(edges)):
        dx, dy = edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1]
        left = 2 * count
        before = _leads(convex, count - 1, dx, dy)
        for i in range(count):
            after = _leads(convex, i, dx, dy)
            left = _placed(sums[e], left, convex[i], edges[e], before)
            if before != after:
                left = _placed(sums[e], left, convex[i], edges[e], after)
            before = after
        first[e] = left
    least = first.min() if len(edges) > 0 else 0
    for e in range(len(edges)):
        for i in range(least, first[e]):
            sums[e, i] = sums[e, first[e]]
    return sums[:, least:]


@numba.njit(cache=True)
def _leads(convex: FloatArray, i: int, dx: float, dy: float) -> bool:
    """Whether the side from vertex i to the next one lies ahead along an edge."""
    k = i + 1 if i + 1 < len(convex) else 0
    ahead: bool = dx * (convex[k, 1] - convex[i, 1]) - dy * (convex[k, 0] - convex[i, 0]) > 0.0
    return ahead


@numba.njit(cache=True)
def _placed(ring: FloatArray, left: int, vertex: FloatArray, edge: FloatArray, head: bool) -> int:
    """Put a vertex, shifted to the edge's head or tail, before the last ones; returns the places left."""
    end = 2 if head else 0
    ring[left - 1, 0], ring[left - 1, 1] = vertex[0] + edge[end], vertex[1] + edge[end + 1]
    return left - 1
