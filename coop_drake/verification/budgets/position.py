"""Check that the object's position holds under a plan's budget: its tube and its regions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from coop_drake.answers.budget import AxisTracking, Budget, PositionTube
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.verification.budgets.alarms import alarms_of, check_alarms
from coop_drake.verification.budgets.position_loop import position_bounds
from coop_drake.verification.checks import Check

ROUNDING = 1e-9
"""Differences that rounding explains, relative and absolute [m, s]."""

_BOUNDS = ("radius", "rate", "velocity", "rest", "acceleration", "ahead")


def check_position(plan: Plan, position_tolerance: float) -> list[Check]:
    """Check what a plan states about its position under its budget; nothing for a plan without one.

    Args:
        plan: The plan.
        position_tolerance: How close to the goal the object shall come to rest [m].

    Raises:
        RefusalError: Names the entry, and what the budget gives.
    """
    if plan.budget is None:
        for where, stated in (("tube", plan.tube), ("alarms", plan.alarms), *_regions(plan)):
            if stated is not None:
                raise RefusalError(where, "is stated, but the plan has no budget")
        return []
    if plan.tube is None:
        raise RefusalError("tube", "is missing, but the plan has a budget")
    budget = of_origin(plan.budget, plan.axis_tracking)
    _check_tube(plan, plan.tube, budget)
    room = check_alarms(alarms_of(plan), plan.tube, budget)
    least = min(_check_region(plan, k, room) for k in range(len(plan.cells)))
    for k in range(len(plan.cells)):
        _check_path(plan, k)
    checks = [
        Check("the object stays in its cells under the budget", len(plan.cells), least, "m to spare, least")
    ]
    rest, away = plan.tube.rest, float(np.hypot(*(plan.transitions[-1].target - plan.goal_pose[:2])))
    room = position_tolerance - away
    if not rest < room:
        finding = f"is {rest:.6g} m; the goal's tolerance leaves {room:.6g} m about the last target"
        raise RefusalError("tube.rest", finding)
    checks.append(Check("the object comes to rest at the goal", 1, room - rest, "m to spare"))
    return checks


def of_origin(budget: Budget, tracking: AxisTracking | None) -> Budget:
    """Return the budget of the object's origin, with what the stated friction of joints adds to its error."""
    if tracking is None or not tracking.disturbance:
        return budget
    return replace(budget, acceleration_error=budget.acceleration_error + tracking.disturbance[0])


def _regions(plan: Plan) -> list[tuple[str, Polygon | None]]:
    return [
        (f"transitions[{k}].governed", transition.governed) for k, transition in enumerate(plan.transitions)
    ]


def _check_tube(plan: Plan, tube: PositionTube, budget: Budget) -> None:
    """Check the tube against the responses of the loop, which must be the same in all transitions."""
    gains = [transition.gains for transition in plan.transitions]
    for k, own in enumerate(gains):
        for name in ("stiffness", "damping"):
            if getattr(own, name) != getattr(gains[0], name):
                finding = f"is {getattr(own, name):.6g}; a plan with a tube has one for all transitions"
                raise RefusalError(f"transitions[{k}].gains.{name}", finding)
    limit = gains[0].speed_limit  # check_speeds has seen that all transitions have the same
    if limit is not None and not tube.velocity <= limit:
        finding = f"is {tube.velocity:.6g} m/s; the gains' limit of speed is {limit:.6g} m/s"
        raise RefusalError("tube.velocity", finding)
    found = position_bounds(tube, gains[0].stiffness, gains[0].damping, budget)
    for name, value in zip(_BOUNDS, found, strict=True):
        stated = getattr(tube, name)
        if not stated >= value * (1.0 - ROUNDING) - ROUNDING:
            raise RefusalError(f"tube.{name}", f"is {stated:.6g}; the budget gives up to {value:.6g}")


def _check_region(plan: Plan, k: int, room: float) -> float:
    """Check the governed set of a transition; return by how much more than needed it is inside its cell [m].

    Args:
        plan: The plan.
        k: The transition.
        room: How far the object may be off its nominal position while no report tells of it [m].
    """
    cell, region, where = plan.cells[k].tidied, plan.transitions[k].governed, f"transitions[{k}].governed"
    if region is None:
        raise RefusalError(where, "is missing, but the plan has a budget")
    if not cell.contains(region):
        raise RefusalError(where, "leaves its cell")
    away = float(shapely.distance(region.boundary, cell.boundary))
    if not away >= room:
        finding = (
            f"comes within {away:.6g} m of the cell's boundary; the tube and its monitor need {room:.6g} m"
        )
        raise RefusalError(where, finding)
    return away - room


def _check_path(plan: Plan, k: int) -> None:
    """Check that p_G can go from where a governed set is entered to a target in this and the next one."""
    transition, where, region = plan.transitions[k], f"transitions[{k}]", plan.governed(k)
    path = LineString(transition.path)
    kept = float(shapely.distance(path, region.boundary)) - transition.neck
    entered = plan.start[:2] if k == 0 else plan.transitions[k - 1].target
    if not region.contains(path) or path.coords[0] != tuple(entered) or not kept >= -ROUNDING:
        raise RefusalError(f"{where}.path", "does not keep its clearance in the governed set")
    target = Point(transition.target)
    for i in range(k, min(k + 2, len(plan.cells))):
        held = plan.governed(i)
        if not held.contains(target):
            raise RefusalError(f"{where}.target", "is outside a governed set that it joins")
        if not float(held.boundary.distance(target)) >= transition.inradius - ROUNDING:
            raise RefusalError(f"{where}.inradius", "is more than the governed sets leave")
