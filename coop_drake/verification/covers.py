"""Check that outside some cells the team is in collision at all angles of a slice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import shapely
from shapely import Polygon, box
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.free_positions import BEYOND, FreePositions
from coop_drake.verification.halving import first_failure

__all__ = ["check_blocked", "check_cover", "check_near_floor", "uncovered"]

TOLERANCES = (3e-4, 3e-5, 3e-6, 2e-7)
"""How much an inner sweep may leave out, tried in this order: coarse ones are quick and often enough [m]."""

HALVINGS = 4
"""How many times a slice is halved before it is refused: at most 16 parts along one axis [-]."""

WIDENING = 1e-12
"""Slices are widened by this at either end; it is more than the rounding of a whole turn [rad, m]."""


def check_cover(
    free: FreePositions, lower: FloatArray, upper: FloatArray, cells: list[Polygon], where: str
) -> float:
    """Check that at every position outside the cells, at all angles of the slice, the team is in collision.

    Args:
        free: Over-approximations of the free positions.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        cells: The cells.
        where: Name of the slice, for the message.

    Returns:
        The coarsest tolerance of the sweeps that was sufficient [m].

    Raises:
        RefusalError: Names the slice and a position that is not covered.
    """
    cover, finest = shapely.union_all(cells), TOLERANCES[0]

    def failure(low: FloatArray, high: FloatArray) -> str:
        nonlocal finest
        if not cells and free.bodies_overlap(low, high, TOLERANCES[0]):
            return ""
        rest, tolerance = uncovered(partial(free.outside, cover, low, high))
        finest = min(finest, tolerance)
        if rest.is_empty or free.bodies_overlap(low, high, TOLERANCES[-1]):
            return ""
        point = rest.representative_point()
        return f"no cell covers ({point.x:.6f}, {point.y:.6f}), which may be free"

    _require(failure, free, lower, upper, where)
    return finest


def check_blocked(
    free: FreePositions, lower: FloatArray, upper: FloatArray, place: FloatArray, where: str
) -> None:
    """Check that the team is in collision at one position and all angles of a slice.

    Args:
        free: Over-approximations of the free positions.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        place: The position p_WL, shape (2,) [m].
        where: Name of the slice, for the message.

    Raises:
        RefusalError: Names the slice.
    """

    def failure(low: FloatArray, high: FloatArray) -> str:
        if any(free.collides_at(low, high, place, tolerance) for tolerance in TOLERANCES):
            return ""
        return f"the team may be free at ({place[0]}, {place[1]})"

    _require(failure, free, lower, upper, where)


def check_near_floor(cells: Sequence[Polygon], problem: PlanningProblem, where: str) -> None:
    """Refuse cells that reach far beyond the floor: numbers of any size would spoil the rounding of covers.

    Args:
        cells: The cells.
        problem: The problem.
        where: Name of the slice, for the message.

    Raises:
        RefusalError: Names the slice and the cell.
    """
    near = box(*problem.workspace.bounds).buffer(2.0 * (problem.tree.reach + BEYOND), join_style="mitre")
    for k, cell in enumerate(cells):
        if not near.covers(cell):
            raise RefusalError(where, f"cell {k} reaches to {cell.bounds}, far beyond the floor")


def uncovered(outside: Callable[[float], BaseGeometry]) -> tuple[BaseGeometry, float]:
    """Positions that no tolerance shows to be covered, empty if one does, and the last tolerance [m]."""
    for tolerance in TOLERANCES:
        rest = outside(tolerance)
        if rest.is_empty:
            break
    return rest, tolerance


def _require(
    failure: Callable[[FloatArray, FloatArray], str],
    free: FreePositions,
    lower: FloatArray,
    upper: FloatArray,
    where: str,
) -> None:
    axes = {stage.axis for solid in free.solids for stage in solid.stages}
    found = first_failure(failure, lower - WIDENING, upper + WIDENING, axes, HALVINGS)
    if found:
        raise RefusalError(where, found)
