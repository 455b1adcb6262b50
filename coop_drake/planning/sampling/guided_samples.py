"""Compiled samples around a guide path: along all of it, or, on a long one, where trees have come far."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.tree.pose import FloatArray

__all__ = ["draw_near", "furthest_row", "guide_row"]

_GUIDED = 0.85
"""Fraction of the samples that are drawn around the guiding path [-]; the others are uniform."""

_LEAST_SPREAD = 0.1
"""Smallest fraction of the spread that a guided sample uses [-]: some samples stay close to the guide."""

_LONG_GUIDE = 400
"""A guide with more rows than this [-] is followed: most samples are drawn where a tree has come furthest,
because those far from both trees are of little use."""

_EVERYWHERE = 0.2
"""Fraction of the samples around such a guide that are drawn along all of it [-]."""

_WINDOW = 20
"""The others are drawn up to so many rows before and after the furthest row: two metres of way."""

_AT_ROW = 0.5
"""A tree has reached a row of the guide when it has a node this near to it [m]."""


@compiled
def guide_row(number: float, front: int, count: int) -> int:
    """Row of a guide to sample around, for a random number in [0, 1) and the furthest row that is reached."""
    if count <= _LONG_GUIDE:
        return min(count - 1, int(number * count))
    if number < _EVERYWHERE:
        return int(number / _EVERYWHERE * count)
    first, last = max(0, front - _WINDOW), min(count, front + _WINDOW + 1)
    return first + int((number - _EVERYWHERE) / (1.0 - _EVERYWHERE) * (last - first))


@compiled
def furthest_row(guide: FloatArray, front: int, side: int, z: FloatArray) -> int:
    """Furthest row of a guide that the tree of a side has reached, now that it has a node at z."""
    step, row = 1 - 2 * side, front
    for _ in range(2 * _WINDOW if len(guide) > _LONG_GUIDE else 0):
        row += step
        if row < 0 or row >= len(guide):
            break
        if (z[0] - guide[row, 0]) ** 2 + (z[1] - guide[row, 1]) ** 2 < _AT_ROW * _AT_ROW:
            front = row
    return front


@compiled
def draw_near(
    u: FloatArray, at: int, guide: FloatArray, spread: FloatArray, lower: FloatArray, upper: FloatArray
) -> FloatArray:
    """One sample: mostly around a row of the guide, uniform otherwise and on axes without spread.

    Some keep closer to the guide than others: what is narrow for the guide is narrower for what it guides.
    """
    z = np.empty(len(lower))
    for k in range(len(z)):
        z[k] = lower[k] + u[2 + k] * (upper[k] - lower[k])
    if len(guide) > 0 and u[0] < _GUIDED:
        fraction = _LEAST_SPREAD + (1.0 - _LEAST_SPREAD) * u[0] / _GUIDED
        for k in range(len(z)):
            if spread[k] > 0.0:
                z[k] = guide[at, k] + (2.0 * u[2 + k] - 1.0) * fraction * spread[k]
                if k > 2:
                    z[k] = min(upper[k], max(lower[k], z[k]))
    return z
