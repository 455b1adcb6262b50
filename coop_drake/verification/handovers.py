"""Check that a plan's regions are nested, its consecutive cells overlap, and its ends are start and goal."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check

__all__ = ["check_ends", "check_handovers", "check_nesting"]

ROUNDING = 1e-9
"""Boundaries that goal region and tidied cell share may differ by this; the safe region holds both [m]."""


def check_nesting(plan: Plan) -> Check:
    """Check that core and tidied cell lie inside the safe region, and goal regions inside both their cells.

    Raises:
        RefusalError: Names the region that leaves the other.
    """
    for k, (cell, transition) in enumerate(zip(plan.cells, plan.transitions, strict=True)):
        for name in ("core", "tidied"):
            _require_inside(getattr(cell, name), cell.safe, f"cells[{k}].{name}", f"cells[{k}].safe")
        region = transition.goal_region
        for m in range(k, min(k + 2, len(plan.cells))):
            where = f"transitions[{k}].goal_region"
            _require_inside(region, plan.cells[m].safe, where, f"cells[{m}].safe")
            _require_inside(region, plan.cells[m].tidied.buffer(ROUNDING), where, f"cells[{m}].tidied")
    return Check("core, tidied cell and goal region inside the safe cell", 4 * len(plan.cells) - 1)


def check_handovers(plan: Plan) -> tuple[Check, Check, Check]:
    """Check that consecutive cells overlap in the plane and on every axis, and that transitions end in both.

    Raises:
        RefusalError: Names the cell or transition, the axis and the value.
    """
    distances, widths, areas = [], [], []
    for k, transition in enumerate(plan.transitions):
        for m in range(k, min(k + 2, len(plan.cells))):
            _require_intervals(transition, plan.cells[m], f"transitions[{k}]", f"cells[{m}]")
        distances.append(_inside(transition.target, transition.goal_region, f"transitions[{k}].target"))
        if k + 1 < len(plan.cells):
            here, onwards = plan.cells[k], plan.cells[k + 1]
            shared = np.minimum(here.upper, onwards.upper) - np.maximum(here.lower, onwards.lower)
            if (shared <= 0.0).any():
                raise RefusalError(
                    f"cells[{k}], cells[{k + 1}]",
                    f"do not overlap on axis {int(np.argmin(shared))}: "
                    f"the gap is {abs(shared.min())} (rad or m)",
                )
            widths.append(float(shared.min()))
            areas.append(_overlap(here.core, onwards.core, f"cells[{k}].core, cells[{k + 1}].core"))
    return (
        Check("targets inside their goal regions", len(distances), min(distances), "m to the boundary"),
        Check("consecutive cells overlap on every axis", len(widths), min(widths, default=None), "rad or m"),
        Check("cores of consecutive cells overlap", len(areas), min(areas, default=None), "m² shared"),
    )


def check_ends(plan: Plan, problem: PlanningProblem) -> Check:
    """Check that the start lies in the first cell, and that the last transition ends within the tolerances.

    Raises:
        RefusalError: Names the entry and the value.
    """
    first, last, final = plan.cells[0], plan.cells[-1], plan.transitions[-1]
    where = f"transitions[{len(plan.transitions) - 1}]"
    _inside(plan.start[:2], first.tidied, "start")
    _require_held(plan.start[2:], first.lower, first.upper, "start", "cells[0]")
    _inside(plan.goal_pose[:2], last.tidied, "goal_pose")
    if not np.array_equal(final.target, plan.goal_pose[:2]):
        raise RefusalError(f"{where}.target", f"{final.target.tolist()} is not the goal's position")
    corners = shapely.get_coordinates(final.goal_region) - plan.goal_pose[:2]
    away = float(np.hypot(*corners.T).max())
    if away > problem.position_tolerance + ROUNDING:
        raise RefusalError(
            f"{where}.goal_region",
            f"reaches {away} m from the goal; {problem.position_tolerance} m are tolerated",
        )
    tolerances = [problem.angle_tolerance, *[problem.joint_tolerance] * len(plan.goal_joints)]
    goals = [float(plan.goal_pose[2]), *plan.goal_joints]
    for axis, (goal, tolerance) in enumerate(zip(goals, tolerances, strict=True)):
        low, high = final.goal_lower[axis], final.goal_upper[axis]
        if goal is not None and not goal - tolerance <= low <= goal <= high <= goal + tolerance:
            raise RefusalError(
                f"{where}.goal_lower, goal_upper",
                f"[{low}, {high}] on axis {axis} is not about {goal} within {tolerance}",
            )
    return Check("start in the first cell, goal region and intervals within the tolerances", 2)


def _require_inside(inner: Polygon, outer: Polygon, where: str, what: str) -> None:
    if not outer.covers(inner):
        point = inner.difference(outer).representative_point()
        place = "" if point.is_empty else f" at ({point.x:.6f}, {point.y:.6f})"
        raise RefusalError(where, f"leaves {what}{place}")


def _require_intervals(transition: Transition, cell: Cell, where: str, what: str) -> None:
    _require_held(transition.goal_lower, cell.lower, cell.upper, f"{where}.goal_lower", what)
    _require_held(transition.goal_upper, cell.lower, cell.upper, f"{where}.goal_upper", what)
    if not (transition.goal_lower < transition.goal_upper).all():
        axis = int(np.argmin(transition.goal_upper - transition.goal_lower))
        lower, upper = transition.goal_lower[axis], transition.goal_upper[axis]
        raise RefusalError(f"{where}.goal_upper[{axis}]", f"{upper} is not above the lower end {lower}")


def _require_held(values: FloatArray, lower: FloatArray, upper: FloatArray, where: str, what: str) -> None:
    held = (lower <= values) & (values <= upper)
    if not held.all():
        axis = int(np.argmin(held))
        raise RefusalError(
            f"{where}, axis {axis}", f"{values[axis]} is not in {what}'s [{lower[axis]}, {upper[axis]}]"
        )


def _inside(point: FloatArray, region: Polygon, where: str) -> float:
    """Distance of a point from the boundary of the region that it must lie inside [m]."""
    distance = float(region.boundary.distance(Point(point)))
    if not region.contains(Point(point)) or distance <= 0.0:
        raise RefusalError(where, f"{point.tolist()} is not inside its region")
    return distance


def _overlap(first: Polygon, second: Polygon, where: str) -> float:
    area = float(shapely.intersection(first, second).area)
    if area <= 0.0:
        raise RefusalError(where, "do not overlap")
    return area
