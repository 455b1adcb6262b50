"""What every executable plan satisfies: targets shared by neighbours, goals inside slices."""

from __future__ import annotations

import numpy as np
from shapely import Point

from coop_drake.answers.plan import Plan
from coop_drake.errors import PlanError

ROUNDING = 1e-9
"""Regions and intervals that share a boundary may differ by so much [m, rad]."""


def check_plan(plan: Plan, file: str) -> None:
    """Refuse a plan that could not be executed safely.

    Raises:
        PlanError: Names the file that it comes from, the key and what is allowed.
    """
    _check_ends(plan, file)
    for k in range(len(plan.cells)):
        for m in range(k, min(k + 2, len(plan.cells))):
            _check_handover(plan, k, m, file)


def _check_handover(plan: Plan, k: int, m: int, file: str) -> None:
    """Transition k must end inside cell m, its own or the next one."""
    transition, cell = plan.transitions[k], plan.cells[m]
    if not plan.governed(m).contains(Point(transition.target)):
        region = "cells[{}].tidied" if plan.transitions[m].governed is None else "transitions[{}].governed"
        raise PlanError(
            f"{file}: transitions[{k}].target: {transition.target.tolist()} is not allowed; expected a point "
            f"inside {region.format(m)}"
        )
    inside = (cell.lower - ROUNDING <= transition.goal_lower) & (
        transition.goal_upper <= cell.upper + ROUNDING
    )
    if not inside.all():
        axis = int(np.argmin(inside))
        interval = [float(transition.goal_lower[axis]), float(transition.goal_upper[axis])]
        raise PlanError(
            f"{file}: transitions[{k}].goal_lower, goal_upper: axis {axis}: {interval} is not allowed; "
            f"expected an interval inside cells[{m}]'s [{cell.lower[axis]}, {cell.upper[axis]}]"
        )


def _check_ends(plan: Plan, file: str) -> None:
    first, start = plan.cells[0], plan.start
    if not first.tidied.contains(Point(start[:2])) or not _holds(first.lower, start[2:], first.upper):
        raise PlanError(
            f"{file}: start: {start.tolist()} is not allowed; expected a configuration in cells[0]"
        )


def _holds(lower: np.ndarray, values: np.ndarray, upper: np.ndarray) -> bool:
    return bool(((lower - ROUNDING <= values) & (values <= upper + ROUNDING)).all())
