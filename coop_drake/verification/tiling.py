"""Whether boxes of angles tile a range without gap or overlap, and which of them share a facet: exactly."""

from __future__ import annotations

from math import ulp

import numpy as np
from numpy.typing import NDArray

from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray

__all__ = ["check_tiling", "facet_pairs", "turn_is_whole"]

TURN = 2.0 * np.pi

ROUNDING = 4.0
"""A whole turn is 2 pi up to so many units in the last place; sweeps are widened by more than that [-]."""

CHUNK = 256


def turn_is_whole(lower: float, upper: float) -> bool:
    """Whether an interval of theta is a whole turn up to the rounding of its ends."""
    return abs((upper - lower) - TURN) <= ROUNDING * ulp(max(abs(lower), abs(upper), TURN))


def check_tiling(lower: FloatArray, upper: FloatArray, whole: tuple[FloatArray, FloatArray]) -> None:
    """Make sure that boxes tile a box: cuts that pass between them lead down to every single one.

    No arithmetic is done on the ends: they must meet to the last bit.

    Args:
        lower: Lower ends, shape (N, m).
        upper: Upper ends, shape (N, m).
        whole: Lower and upper ends of the box to be tiled, shape (m,) each.

    Raises:
        RefusalError: Names the slice that overlaps others or leaves a gap.
    """
    left = [(np.arange(len(lower)), *whole)]
    while left:
        members, low, high = left.pop()
        if len(members) == 1:
            k = int(members[0])
            off = (lower[k] != low) | (upper[k] != high)
            if off.any():
                axis = int(np.argmax(off))
                raise RefusalError(
                    f"slices[{k}]",
                    f"[{lower[k, axis]}, {upper[k, axis]}] on axis {axis} leaves a gap or an overlap in "
                    f"[{low[axis]}, {high[axis]}]",
                )
            continue
        cut = _cut(lower[members], upper[members])
        if cut is None:
            raise RefusalError(
                f"slices[{int(members[0])}]", f"and {len(members) - 1} others do not tile a box"
            )
        axis, value = cut
        below = upper[members, axis] <= value
        onwards, back = high.copy(), low.copy()
        onwards[axis] = back[axis] = value
        left += [(members[below], low, onwards), (members[~below], back, high)]


def facet_pairs(lower: FloatArray, upper: FloatArray) -> NDArray[np.int64]:
    """Pairs of boxes of a tiling that share a facet, across the end of theta's turn too, shape (k, 2).

    Args:
        lower: Lower ends, theta on axis 0, shape (N, m).
        upper: Upper ends, shape (N, m).
    """
    first, last = lower[:, 0].min(), upper[:, 0].max()
    pairs = [_touching(lower, upper, lower, upper)]
    ends, begins = np.flatnonzero(upper[:, 0] == last), np.flatnonzero(lower[:, 0] == first)
    moved_lower, moved_upper = lower[begins].copy(), upper[begins].copy()
    moved_lower[:, 0], moved_upper[:, 0] = last, last + 1.0
    across = _touching(lower[ends], upper[ends], moved_lower, moved_upper)
    pairs.append(np.stack((ends[across[:, 0]], begins[across[:, 1]]), axis=1))
    return np.concatenate(pairs)


def _touching(
    lower: FloatArray, upper: FloatArray, other_lower: FloatArray, other_upper: FloatArray
) -> NDArray[np.int64]:
    """Pairs of boxes that touch in every axis and merely touch in one, shape (k, 2)."""
    found = [np.empty((0, 2), dtype=np.int64)]
    for begin in range(0, len(lower), CHUNK):
        low, high = lower[begin : begin + CHUNK, None], upper[begin : begin + CHUNK, None]
        touch = ((low <= other_upper) & (other_lower <= high)).all(axis=2)
        merely = ((low == other_upper) | (other_lower == high)).sum(axis=2)
        rows, columns = np.nonzero(touch & (merely <= 1))
        found.append(np.stack((rows + begin, columns), axis=1))
    return np.concatenate(found)


def _cut(lower: FloatArray, upper: FloatArray) -> tuple[int, float] | None:
    """An axis and a value that no box reaches across, with boxes on both sides; the most even one."""
    best: tuple[int, int, float] | None = None
    count = len(lower)
    for axis in range(lower.shape[1]):
        order = np.argsort(lower[:, axis], kind="stable")
        highest = np.maximum.accumulate(upper[order, axis])[:-1]
        begins = lower[order[1:], axis]
        clean = np.flatnonzero(highest <= begins)
        if len(clean):
            middle = int(clean[np.argmin(np.abs(2 * (clean + 1) - count))])
            uneven = abs(2 * (middle + 1) - count)
            if best is None or uneven < best[0]:
                best = (uneven, axis, float(begins[middle]))
    return None if best is None else best[1:]
