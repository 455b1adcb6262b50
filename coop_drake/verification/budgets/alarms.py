"""Whether a plan's monitors see what departs, and leave alone what does not: their levels, computed again.

A level must not be below what the budget lets a robot measure, its departure and the noise of one robot. What
departs just below it, with the noise that may hide it and by how much it grows until a report is used that
does not know of it, must still be where the certificates are: the object in its cell, an axis in its funnel.
"""

from __future__ import annotations

import numpy as np

from coop_drake.answers.budget import Alarms, AxisTracking, Budget, PositionTube, Tolerance
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.axis_departure import mistaken
from coop_drake.verification.budgets.position_loop import unseen_in

ROUNDING = 1e-9
"""Differences that rounding explains [m, rad, and per second]."""


def alarms_of(plan: Plan) -> Alarms:
    """Return the levels that a plan with a budget states for all transitions.

    Raises:
        RefusalError: They are missing.
    """
    if plan.alarms is None:
        raise RefusalError("alarms", "is missing, but the plan has a budget")
    return plan.alarms


def check_alarms(alarms: Alarms, tube: PositionTube, budget: Budget) -> float:
    """Check the levels of position, velocity and grasp; return how wide a cell's strip must be [m].

    Stated departures are no less than those that the budget gives, which has been checked.

    Raises:
        RefusalError: Names the level.
    """
    one = budget.single_noise
    late = 2.0 * budget.clock_error
    position = one * budget.position_noise + late * tube.velocity
    pushed = (1.0 + budget.model_error) * tube.acceleration + budget.acceleration_error
    _check(alarms.position, tube.radius + position, "alarms.position")
    _check(alarms.velocity, tube.rate + one * budget.velocity_noise + late * pushed, "alarms.velocity")
    for name, stated, noise in (
        ("grasp", alarms.grasp, budget.grasp_noise),
        ("turn", alarms.turn, budget.turn_noise),
    ):
        if (stated is None) != (noise is None):
            raise RefusalError(f"alarms.{name}", f"is {stated}; the budget has {noise}")
        if stated is not None and noise is not None:
            _check(stated, noise, f"alarms.{name}")
    if not budget.axes and alarms.axis_reserve.size:
        raise RefusalError("alarms.axis_reserve", "is stated, but the plan has no budget for the axes")
    time, wrong = unseen_in(budget), late * tube.velocity
    further = budget.position_noise + time * budget.velocity_noise
    stale = wrong + time * late * pushed
    _check(alarms.ahead, tube.ahead + one * further + stale, "alarms.ahead")
    straight = max(alarms.position + budget.position_noise, alarms.ahead + further)
    return straight + stale + budget.acceleration_error * time * time / 2.0


def check_axis_alarms(
    alarms: Alarms, stated: Tolerance, budget: Budget, tracking: AxisTracking, where: str
) -> None:
    """Check the levels of the axes in a transition, and that they leave room.

    Where an axis is near a bound of its funnel, its level is what the reserve leaves of the nominal distance.
    That must be no less than what it may depart from its nominal motion, and a robot's noise.

    Raises:
        RefusalError: Names the level and the axis.
    """
    axes = stated.departure.size
    late = np.broadcast_to(mistaken(tracking, budget), (2, axes))
    noise = np.where(np.arange(axes) == 0, budget.single_noise, 1.0)
    wrong = np.outer([budget.angle_noise, budget.rate_noise], noise) + late
    for name, departure, size in (
        ("alarm", stated.departure, wrong[0]),
        ("rate_alarm", stated.rate_departure, wrong[1]),
    ):
        levels: FloatArray = getattr(stated, name)
        if levels.shape != departure.shape:
            raise RefusalError(f"{where}.{name}", f"has {levels.size} numbers, not {axes}")
        for axis, (level, least) in enumerate(zip(levels, departure + size, strict=True)):
            _check(float(level), float(least), f"{where}.{name}[{axis}]")
    if alarms.axis_reserve.shape != (axes,):
        raise RefusalError("alarms.axis_reserve", f"has {alarms.axis_reserve.size} numbers, not {axes}")
    rubbing = tracking.disturbance[1:] or (0.0,) * axes
    for axis, reserve in enumerate(alarms.axis_reserve):
        pushed = budget.axis_acceleration_error + rubbing[axis]
        needed = budget.angle_noise + _grows(budget, budget.rate_noise, pushed) + late[0, axis]
        _check(float(reserve), float(needed), f"alarms.axis_reserve[{axis}]")
        room = float(stated.distance[axis] - wrong[0, axis])
        if not room >= reserve - ROUNDING:
            finding = f"leaves {room:.6g} beside a robot's noise; its monitor needs {reserve:.6g}"
            raise RefusalError(f"{where}.distance[{axis}]", finding)


def _check(stated: float, least: float, where: str) -> None:
    """Refuse a level that is not the one that follows: a lower one rings in vain, a higher one sees less."""
    if not abs(stated - least) <= ROUNDING * (1.0 + least):
        raise RefusalError(where, f"is {stated:.9g}; the budget gives {least:.9g}")


def _grows(budget: Budget, rate: float, acceleration: float) -> float:
    """Return by how much a departure grows that moves no faster than noise hides, until that is known."""
    time = unseen_in(budget)
    return rate * time + acceleration * time * time / 2.0
