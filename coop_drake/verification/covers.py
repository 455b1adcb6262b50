"""Whether cells cover all positions of a slice that may be free, as sharp as need be."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.may_be_free import FreePositions

__all__ = ["check_blocked", "check_cover", "uncovered"]

TOLERANCES = (3e-4, 3e-5, 3e-6, 2e-7)
"""How much sharper inner sweeps could be, coarse first: proofs that leave room need no more [m]."""

HALVINGS = 4
"""A slice whose cells do not cover enough is halved so often before it is refused."""

WIDENING = 1e-12
"""Slices are widened by this, which covers the rounding of a whole turn [rad, m]."""


def check_cover(
    free: FreePositions, lower: FloatArray, upper: FloatArray, cells: list[Polygon], where: str
) -> float:
    """Make sure that no position outside some cells is free at any angles of a slice.

    Args:
        free: Over-approximations of the free positions.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        cells: The cells.
        where: Name of the slice, for the message.

    Returns:
        The tolerance that was sharp enough [m].

    Raises:
        RefusalError: Names the slice and a position that is not covered.
    """
    cover, finest = shapely.union_all(cells), TOLERANCES[0]

    def fails(low: FloatArray, high: FloatArray) -> str:
        nonlocal finest
        if not cells and free.entangled(low, high, TOLERANCES[0]):
            return ""
        rest, tolerance = uncovered(partial(free.outside, cover, low, high))
        finest = min(finest, tolerance)
        if rest.is_empty or free.entangled(low, high, TOLERANCES[-1]):
            return ""
        point = rest.representative_point()
        return f"no cell covers ({point.x:.6f}, {point.y:.6f}), which may be free"

    _halved(free, lower, upper, fails, where)
    return finest


def check_blocked(
    free: FreePositions, lower: FloatArray, upper: FloatArray, place: FloatArray, where: str
) -> None:
    """Make sure that a position is free at no angles of a slice.

    Args:
        free: Over-approximations of the free positions.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        place: The position p_WL, shape (2,) [m].
        where: Name of the slice, for the message.

    Raises:
        RefusalError: Names the slice.
    """

    def fails(low: FloatArray, high: FloatArray) -> str:
        if any(free.fits_nowhere(low, high, place, tolerance) for tolerance in TOLERANCES):
            return ""
        return f"the team may be free at ({place[0]}, {place[1]})"

    _halved(free, lower, upper, fails, where)


def _halved(
    free: FreePositions,
    lower: FloatArray,
    upper: FloatArray,
    fails: Callable[[FloatArray, FloatArray], str],
    where: str,
) -> None:
    """Test a slice; halve it where it fails, and refuse what fails when small or at its very middle."""
    moving = {stage.axis for solid in free.solids for stage in solid.stages}
    axes = sorted(axis for axis in moving if upper[axis] > lower[axis])
    left = [(lower - WIDENING, upper + WIDENING, 0)]
    while left:
        low, high, depth = left.pop()
        finding = fails(low, high)
        if not finding:
            continue
        middle = 0.5 * (low + high)
        if depth == HALVINGS or not axes or fails(middle, middle):
            raise RefusalError(where, finding)
        axis = max(axes, key=lambda axis: (high[axis] - low[axis], -axis))
        for begin, end in ((low[axis], middle[axis]), (middle[axis], high[axis])):
            part_low, part_high = low.copy(), high.copy()
            part_low[axis], part_high[axis] = begin, end
            left.append((part_low, part_high, depth + 1))


def uncovered(outside: Callable[[float], BaseGeometry]) -> tuple[BaseGeometry, float]:
    """What may be free outside a cover, empty if it is nothing at some tolerance, and that tolerance [m]."""
    for tolerance in TOLERANCES:
        rest = outside(tolerance)
        if rest.is_empty:
            break
    return rest, tolerance
