"""Bisection of slices: a statement about all angles of a slice that only smaller slices show."""

from __future__ import annotations

from collections.abc import Callable, Collection

from coop_drake.tree.pose import FloatArray

__all__ = ["first_failure"]


def first_failure(
    failure: Callable[[FloatArray, FloatArray], str],
    lower: FloatArray,
    upper: FloatArray,
    axes: Collection[int],
    halvings: int,
) -> str:
    """Test a slice, and its halves where the test fails.

    The statement holds for a slice if it holds for both halves. It is refused where it fails for a slice that
    was halved often enough already, or for the single configuration in the middle of a slice.

    Args:
        failure: Tests a slice; returns what failed, empty if nothing did.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        axes: Axes that may be halved; the widest one is.
        halvings: How many times a slice may be halved.

    Returns:
        What failed in a part of the slice, empty if the statement holds for all of it.
    """
    wide = sorted(axis for axis in axes if upper[axis] > lower[axis])
    left = [(lower, upper, 0)]
    while left:
        low, high, depth = left.pop()
        found = failure(low, high)
        if not found:
            continue
        middle = 0.5 * (low + high)
        if depth == halvings or not wide or failure(middle, middle):
            return found
        axis = max(wide, key=lambda axis: (high[axis] - low[axis], -axis))
        below, above = high.copy(), low.copy()
        below[axis] = above[axis] = middle[axis]
        left += [(low, below, depth + 1), (above, high, depth + 1)]
    return ""
