"""Compiled cycles that wind once around the positions at which a convex footprint fits between walls."""

from __future__ import annotations

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray, IntArray

_NEEDLE = 1e-12
"""A corner whose edges turn back with a smaller sine than this is a needle [-]: rounding decides its side."""


@compiled
def fitting_cycles(
    points: FloatArray, first: IntArray, extents: FloatArray, convex: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Trace every ring with the footprint's vertex that lies furthest out: the reduced convolution with -F.

    Along an edge the vertex v furthest beyond it draws the edge, shifted by -v. Where the floor is not
    convex the vertices in between follow one by one, clockwise; where it is convex the ends are joined, for
    whatever else the full convolution would draw there lies where the corner is inside the footprint.

    Args:
        points: Vertices of all rings, outer ones counter-clockwise, holes clockwise, none twice in a row,
            shape (E, 2) [m].
        first: Where each ring begins, shape (R + 1,).
        extents: Widths in x and y of what a ring encloses, shape (R, 2); a ring no wider and no higher than F
            is left out [m].
        convex: Convex ring F, counter-clockwise, shape (n, 2) [m].

    Returns:
        Vertices of the cycles, shape (V, 2) [m], and where each begins, shape (R + 1,); none of small rings.
    """
    furthest = _furthest(points, first, convex)
    starts = np.zeros(len(first), np.int64)
    drawn = np.empty((0, 2))
    width, height = _width(convex, 0), _width(convex, 1)
    for writing in range(2):
        size = 0
        for r in range(len(first) - 1):
            before = first[r + 1] - 1
            small = extents[r, 0] <= width and extents[r, 1] <= height
            for i in range(first[r], first[r] if small else first[r + 1]):
                after = i + 1 if i + 1 < first[r + 1] else first[r]
                k, last = furthest[before], furthest[i]
                turn = _bends_in(points, before, i, after)
                while True:
                    if writing == 1:
                        drawn[size, 0] = points[i, 0] - convex[k, 0]
                        drawn[size, 1] = points[i, 1] - convex[k, 1]
                    size += 1
                    if k == last:
                        break
                    k = (k if k > 0 else len(convex)) - 1 if turn else last
                before = i
            starts[r + 1] = size
        if writing == 0:
            drawn = np.empty((size, 2))
    return drawn, starts


@compiled
def _furthest(points: FloatArray, first: IntArray, convex: FloatArray) -> IntArray:
    """Vertex of the footprint that lies furthest out beyond each edge, shape (E,)."""
    furthest = np.zeros(len(points), np.int64)
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1]):
            after = i + 1 if i + 1 < first[r + 1] else first[r]
            x, y = points[after, 1] - points[i, 1], points[i, 0] - points[after, 0]
            most = -np.inf
            for k in range(len(convex)):
                out = x * convex[k, 0] + y * convex[k, 1]
                if out > most:
                    most, furthest[i] = out, k
    return furthest


@compiled(borrows=True)
def _width(ring: FloatArray, axis: int) -> float:
    """Width of a ring, shape (n, 2), along the first (0) or second (1) coordinate [m]."""
    low, high = ring[0, axis], ring[0, axis]
    for k in range(len(ring)):
        low, high = min(low, ring[k, axis]), max(high, ring[k, axis])
    width: float = high - low
    return width


@compiled(borrows=True)
def _bends_in(points: FloatArray, before: int, here: int, after: int) -> bool:
    """Whether a corner of the outline points into the floor, or is a needle, which blocks no more."""
    ax, ay = points[here, 0] - points[before, 0], points[here, 1] - points[before, 1]
    bx, by = points[after, 0] - points[here, 0], points[after, 1] - points[here, 1]
    cross, dot = ax * by - ay * bx, ax * bx + ay * by
    bends: bool = cross <= 0.0 or (dot < 0.0 and cross <= -_NEEDLE * dot)
    return bends
