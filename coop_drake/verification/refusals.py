"""Check which limits of the scenario a plan breaks: what it has is computed again, and it must say so."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot

import numpy as np
from shapely import LineString, Point

from coop_drake.answers.limits import SLOWEST_AGE, Refusal, Unit
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet, ScheduledGains
from coop_drake.planning.duration import estimated
from coop_drake.tree.levers import usual_unit
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check

SAME_VALUE = 1e-6
"""Relative difference of values that are computed twice, maybe on machines that round otherwise [-]."""

ROUNDING = 1e-9
"""Clearances that miss a limit by less than this share of it keep it [-]."""

PLANNED_SHARE = 0.95
"""Share of a joint's limit of acceleration that a plan may command [-]."""

GOAL_SHARE = 0.9
"""The room about the end need not be wider than this share of what the goal's tolerance leaves there [-]."""


def check_limits(plan: Plan, problem: PlanningProblem, gain_set: GainSet) -> list[Check]:
    """Compute clearances, estimated times and accelerations again, and what limits they break.

    A plan that can be carried out breaks none; a way says which ones it breaks, where and by how much.

    Args:
        plan: The plan or way, whose geometry and gains hold.
        problem: What is asked, with the limits.
        gain_set: The gain set that its gains are those of.

    Raises:
        RefusalError: Names the entry, and what is computed.
    """
    again, _, accelerations = estimated(plan)
    for k, (stated, simulated) in enumerate(zip(plan.transitions, again.transitions, strict=True)):
        seconds = simulated.estimated_time
        if not abs(stated.estimated_time - seconds) <= SAME_VALUE * seconds:
            finding = f"is {stated.estimated_time} s; the simulation of this transition takes {seconds} s"
            raise RefusalError(f"transitions[{k}].estimated_time", finding)
    times = np.array([one.estimated_time for one in again.transitions])
    broken = {(one.limit, one.joint): one for one in _broken(plan, problem, times, accelerations)}
    for k, refusal in enumerate(plan.refused_by):
        _check_stated(refusal, broken.get((refusal.limit, refusal.joint)), f"refused_by[{k}]")
    said = {refusal.limit for refusal in plan.refused_by}
    if len(said) < len(plan.refused_by):
        raise RefusalError("refused_by", "names a limit twice")
    for one in broken.values():
        if one.limit not in said:
            raise RefusalError("refused_by", f"does not say that the plan breaks {one.describe()}")
    _check_age(plan, gain_set)
    checks = [Check("times are those of a simulation of each transition", len(times))]
    if plan.refused_by:
        return [*checks, Check("limits of the scenario that the plan breaks", len(plan.refused_by))]
    return [*checks, Check("clearances, times and accelerations keep the scenario's limits", len(times))]


@dataclass(frozen=True)
class _Broken:
    """A limit that is broken.

    Attributes:
        limit, joint, allowed, unit: As a ``Refusal`` has them.
        values: What each cell has, shape (cells,).
        most: What the cell has that breaks it most.
    """

    limit: str
    values: FloatArray
    most: float
    allowed: float
    unit: Unit
    joint: str = ""

    def describe(self) -> str:
        """Say which limit is broken where, and by how much."""
        cell = int(np.argmin(np.abs(self.values - self.most)))
        return Refusal(self.limit, cell, self.most, self.allowed, self.unit, self.joint).describe()


def _check_stated(stated: Refusal, own: _Broken | None, where: str) -> None:
    """Refuse a statement about a limit that is kept or not the scenario's, or about another value."""
    if own is None:
        raise RefusalError(where, f"{stated.describe()}: the scenario has no such limit, or it is kept")
    room = SAME_VALUE * own.most
    known = stated.cell < len(own.values) and (stated.allowed, stated.unit) == (own.allowed, own.unit)
    if not (known and max(abs(stated.value - own.most), abs(own.values[stated.cell] - own.most)) <= room):
        raise RefusalError(where, f"{stated.describe()}: computed again, {own.describe()}")


def _broken(
    plan: Plan, problem: PlanningProblem, times: FloatArray, accelerations: FloatArray
) -> Iterator[_Broken]:
    """The limits that a plan breaks."""
    settings = problem.settings
    least, longest = usual_unit(problem.tree) * settings.min_clearance, settings.max_transition_time
    clear = _clearances(plan, problem, least)
    if clear.min() < least * (1.0 - ROUNDING):
        yield _Broken("planner.min_clearance", clear, float(clear.min()), least, "m")
    if times.max() > longest:
        yield _Broken("planner.max_transition_time", times, float(times.max()), longest, "s")
    for joint, limit in zip(problem.tree.joints, problem.limits.joint_accelerations.tolist(), strict=False):
        peaks = accelerations[:, 1 + joint.index]
        stated = [one.gains.acceleration_limit for one in plan.transitions]
        acting = [
            most is not None and peak >= most[1 + joint.index]
            for peak, most in zip(peaks.tolist(), stated, strict=True)
        ]
        values = peaks / PLANNED_SHARE
        unit: Unit = "rad/s^2" if joint.kind == "revolute" else "m/s^2"
        if np.isfinite(limit) and (values.max() >= limit or any(acting)):
            yield _Broken("limits.joint_accelerations", values, float(values.max()), limit, unit, joint.name)


def _clearances(plan: Plan, problem: PlanningProblem, least: float) -> FloatArray:
    """The least clearance of path and target in each cell [m]; that of the end only where it is too small."""
    clear = []
    for k, transition in enumerate(plan.transitions):
        walls, target = plan.cells[k].tidied.boundary, Point(transition.target)
        path, about = LineString(transition.path).distance(walls), target.distance(walls)
        if k + 1 < len(plan.cells):
            about = min(about, target.distance(plan.cells[k + 1].tidied.boundary))
        else:
            left = problem.position_tolerance - hypot(*(transition.target - problem.goal_pose[:2]))
            about = min(about, left)
            about = np.inf if about >= min(least, GOAL_SHARE * left) * (1.0 - ROUNDING) else about
        clear.append(min(path, about))
    return np.array(clear)


def _check_age(plan: Plan, gain_set: GainSet) -> None:
    """Refuse a way with gains that are slower than it needs, or quicker than they might be."""
    if plan.refused_by and isinstance(gain_set, ScheduledGains):
        quick = any(one.limit == "limits.joint_accelerations" for one in plan.refused_by)
        expected = SLOWEST_AGE if quick else 1.0
        if plan.age_factor != expected:
            finding = f"is {plan.age_factor}; a way that these limits refuse has {expected}"
            raise RefusalError("age_factor", finding)
