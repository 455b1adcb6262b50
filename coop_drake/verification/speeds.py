"""Check what a plan states about speeds: the limits, and that its gains keep them, by bounds computed again.

A point of a component moves at most as fast as the object, plus for every joint on the way (and theta) the
rate of that joint times its lever: for one that turns, the greatest distance of the point from the joint.
"""

from __future__ import annotations

from math import hypot

import numpy as np

from coop_drake.answers.limits import SpeedStatement, TeamLimits
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.funnels import SHAPES
from coop_drake.verification.solids import component_stages

ROUNDING = 1e-9
"""Relative difference of bounds that are computed twice, in another order [-]."""

KEPT = 0.95
"""Share of a joint's limit of acceleration that is commanded at most [-]; the rest is for noise."""


def check_speeds(plan: Plan, problem: PlanningProblem) -> Check | None:
    """Check the limits of speed in a plan and its gains; None where neither models nor scenario state any.

    Raises:
        RefusalError: Names the entry, and what it should be.
    """
    limits, stated = problem.limits, plan.speeds
    if not limits.any:
        gains = [transition.gains for transition in plan.transitions]
        if stated is not None or any(g.speed_limit is not None or g.rate_limit is not None for g in gains):
            raise RefusalError("speeds", "are limited, but neither models nor scenario state a limit")
        return None
    if stated is None:
        raise RefusalError("speeds", "are missing; models or scenario state limits of speed")
    _check_limits(stated, limits)
    speed, rates = _limits_in_gains(plan)
    least = _require_below("transitions[0].gains.rate_limit", rates[1:], limits.joint_rates)
    for name, found, most, turning in (
        ("base_speeds", stated.base_speeds, stated.base_speed_limits, False),
        ("turn_rates", stated.turn_rates, stated.turn_rate_limits, True),
    ):
        bounds = _bounds(problem.tree, limits, speed, rates, turning=turning)
        if found.shape != bounds.shape or not np.allclose(
            found, bounds, rtol=ROUNDING, atol=0.0
        ):  # infinities are equal
            raise RefusalError(f"speeds.{name}", f"are {found.tolist()}; the gains give {bounds.tolist()}")
        least = min(least, _require_below(f"speeds.{name}", bounds, most))
    _check_funnels(plan, rates)
    count = sum(
        int(np.isfinite(values).sum())
        for values in (limits.base_speeds, limits.turn_rates, limits.joint_rates)
    )
    return Check("limits of speed are kept by the gains", count, least, "of one left")


def check_accelerations(plan: Plan, problem: PlanningProblem) -> Check | None:
    """Check that no more is commanded of any joint than its limit of acceleration; None without limits.

    Raises:
        RefusalError: Names the entry, and what it should be.
    """
    limits = problem.limits.joint_accelerations
    known, least = np.isfinite(limits), 1.0
    commanded = np.array([np.inf, *(KEPT * limits)])
    for k, transition in enumerate(plan.transitions):
        where, stated = f"transitions[{k}].gains.acceleration_limit", transition.gains.acceleration_limit
        if stated is None and known.any():
            raise RefusalError(where, "is missing; models or scenario state limits of acceleration")
        if stated is not None and not known.any():
            raise RefusalError(where, "is there, but neither models nor scenario state a limit")
        if stated is not None:
            if not np.allclose(stated, commanded, rtol=ROUNDING, atol=0.0):
                text = f"is {stated.tolist()}; {KEPT:g} of the limits is {commanded.tolist()}"
                raise RefusalError(where, text)
            least = min(least, _require_below(where, stated[1:], limits))
    name = "limits of acceleration are kept by the commands"
    return Check(name, int(known.sum()), least, "of one left") if known.any() else None


def _check_limits(stated: SpeedStatement, limits: TeamLimits) -> None:
    for name, found, expected in (
        ("base_speed_limits", stated.base_speed_limits, limits.base_speeds),
        ("turn_rate_limits", stated.turn_rate_limits, limits.turn_rates),
        ("joint_rate_limits", stated.joint_rate_limits, limits.joint_rates),
    ):
        if not np.array_equal(found, expected):
            text = f"are {found.tolist()}; models and scenario state {expected.tolist()}"
            raise RefusalError(f"speeds.{name}", text)


def _limits_in_gains(plan: Plan) -> tuple[float, FloatArray]:
    """The largest speed of the object and the rates of all axes, which are the same in all transitions."""
    first = plan.transitions[0].gains
    if first.rate_limit is None:
        raise RefusalError("transitions[0].gains.rate_limit", "is missing")
    for k, transition in enumerate(plan.transitions):
        gains, where = transition.gains, f"transitions[{k}].gains"
        if gains.speed_limit != first.speed_limit:
            raise RefusalError(f"{where}.speed_limit", f"is {gains.speed_limit}, not {first.speed_limit}")
        if gains.rate_limit is None or not np.array_equal(gains.rate_limit, first.rate_limit):
            raise RefusalError(f"{where}.rate_limit", "is not that of the first transition")
    return np.inf if first.speed_limit is None else first.speed_limit, first.rate_limit


def _require_below(where: str, values: FloatArray, limits: FloatArray) -> float:
    """Refuse values above their limits; return what the tightest leaves, as a share of its limit."""
    known = np.isfinite(limits)
    if not (values[known] <= limits[known]).all():
        raise RefusalError(where, f"{values.tolist()} exceed the limits {limits.tolist()}")
    return float((1.0 - values[known] / limits[known]).min(initial=1.0))


def _bounds(
    tree: ComponentTree, limits: TeamLimits, speed: float, rates: FloatArray, *, turning: bool
) -> FloatArray:
    """Largest speeds of all bases [m/s], or their largest turn rates [rad/s], shape (N,)."""
    bounds = []
    for component, point in zip(limits.base_components, limits.base_points, strict=True):
        reach, bound = hypot(*point), 0.0 if turning else speed
        for stage in component_stages(tree, component):
            turns, length = stage.kind == "revolute", hypot(*stage.direction)
            lever = float(turns) if turning else reach if turns else length
            bound += lever * float(rates[stage.axis]) if lever > 0.0 else 0.0
            if not turns:
                joint = tree.joints[stage.axis - 1]
                reach += length * max(abs(joint.lower), abs(joint.upper))
            reach += hypot(stage.X_PJ.x, stage.X_PJ.y)
        bounds.append(bound)
    return np.array(bounds)


def _check_funnels(plan: Plan, rates: FloatArray) -> None:
    """Refuse funnels whose bounds move faster than the axis that they hold may."""
    for k, (cell, transition) in enumerate(zip(plan.cells, plan.transitions, strict=True)):
        gains = transition.gains
        moved = np.maximum(transition.goal_lower - cell.lower, cell.upper - transition.goal_upper)
        fastest = SHAPES[gains.funnel][1] * gains.decay_rate * moved
        if not (fastest <= rates).all():
            axis = int(np.argmax(fastest > rates))
            text = f"moves a bound of axis {axis} at {fastest[axis]:.6g}, faster than {rates[axis]:.6g}"
            raise RefusalError(f"transitions[{k}].gains.decay_rate", text)
