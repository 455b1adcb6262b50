"""Check exactly, without arithmetic, that boxes of angles tile a range; find those that share a facet."""

from __future__ import annotations

from math import tau, ulp

import numpy as np
from numpy.typing import NDArray

from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray

__all__ = ["check_tiling", "facet_pairs", "turn_is_whole"]

ROUNDING = 4.0
"""An interval is a whole turn if its length is 2 pi up to so many units in the last place [-].

Slices are widened by more than that before they are swept.
"""

CHUNK = 256
"""Boxes that are compared with all others at once: this bounds the memory [-]."""


def turn_is_whole(lower: float, upper: float) -> bool:
    """Whether an interval of theta is a whole turn up to the rounding of its ends."""
    return abs((upper - lower) - tau) <= ROUNDING * ulp(max(abs(lower), abs(upper), tau))


def check_tiling(lower: FloatArray, upper: FloatArray, whole: tuple[FloatArray, FloatArray]) -> None:
    """Check that boxes tile a range without gap or overlap.

    Planes that no box reaches across part the boxes, and the range with them, again and again until each part
    holds a single box, which must be equal to it to the last bit. Any subdivision by halving can be parted
    so.

    Args:
        lower: Lower ends of the boxes, shape (N, m).
        upper: Upper ends, shape (N, m).
        whole: Lower and upper ends of the range, shape (m,) each; an axis of the range may be a single value.

    Raises:
        RefusalError: Names the slice that overlaps others or leaves a gap.
    """
    left = [(np.arange(len(lower)), *whole)]
    while left:
        members, low, high = left.pop()
        k = int(members[0])
        if len(members) == 1:
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
            raise RefusalError(f"slices[{k}]", f"and {len(members) - 1} others do not tile a box")
        axis, value = cut
        below = upper[members, axis] <= value
        middle_high, middle_low = high.copy(), low.copy()
        middle_high[axis] = middle_low[axis] = value
        left += [(members[below], low, middle_high), (members[~below], middle_low, high)]


def facet_pairs(lower: FloatArray, upper: FloatArray) -> NDArray[np.int64]:
    """Pairs of boxes of a tiling that share a facet, across the end of theta's turn too, shape (k, 2).

    Args:
        lower: Lower ends, theta on axis 0, shape (N, m).
        upper: Upper ends, shape (N, m).
    """
    first, last = lower[:, 0].min(), upper[:, 0].max()
    ends, begins = np.flatnonzero(upper[:, 0] == last), np.flatnonzero(lower[:, 0] == first)
    moved_lower, moved_upper = lower[begins].copy(), upper[begins].copy()
    moved_lower[:, 0], moved_upper[:, 0] = last, last + 1.0
    across = _touching(lower[ends], upper[ends], moved_lower, moved_upper)
    across = np.stack((ends[across[:, 0]], begins[across[:, 1]]), axis=1)
    return np.concatenate((_touching(lower, upper, lower, upper), across))


def _touching(
    lower: FloatArray, upper: FloatArray, other_lower: FloatArray, other_upper: FloatArray
) -> NDArray[np.int64]:
    """Pairs of boxes that overlap in all axes but one, in which they touch, shape (k, 2)."""
    found = [np.empty((0, 2), dtype=np.int64)]
    for begin in range(0, len(lower), CHUNK):
        low, high = lower[begin : begin + CHUNK, None], upper[begin : begin + CHUNK, None]
        touch = ((low <= other_upper) & (other_lower <= high)).all(axis=2)
        merely = ((low == other_upper) | (other_lower == high)).sum(axis=2)
        rows, columns = np.nonzero(touch & (merely <= 1))
        found.append(np.stack((rows + begin, columns), axis=1))
    return np.concatenate(found)


def _cut(lower: FloatArray, upper: FloatArray) -> tuple[int, float] | None:
    """An axis and a value that no box reaches across, with boxes on either side; the most even such cut."""
    best: tuple[int, int, float] | None = None
    count = len(lower)
    for axis in range(lower.shape[1]):
        order = np.argsort(lower[:, axis], kind="stable")
        highest = np.maximum.accumulate(upper[order, axis])[:-1]
        begins = lower[order[1:], axis]
        # Boxes that are a single value on this axis lie at the cut itself: they must not end below it too.
        clean = np.flatnonzero((highest <= begins) & (upper[order[1:], axis] > begins))
        if len(clean):
            middle = int(clean[np.argmin(np.abs(2 * (clean + 1) - count))])
            uneven = abs(2 * (middle + 1) - count)
            if best is None or uneven < best[0]:
                best = (uneven, axis, float(begins[middle]))
    return None if best is None else best[1:]
