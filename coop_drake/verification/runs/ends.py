"""Check that a run begins at rest at the plan's start, and that it ends at the goal."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.runs.rows import Rows

SAME = 1e-9
"""A run may begin this far from the plan's start [m, rad, and per s]: rounding."""


def check_start(rows: Rows, displacement: FloatArray) -> Check:
    """Check that the run begins at rest where the scenario says, with p_G at the plan's start.

    Under a budget the team may stand off the plan's start by the largest errors of measurement, as a team
    does that has come to rest with constant ones.

    Args:
        rows: The log.
        displacement: How far the team stands off the plan's start, shape (3 + n,) [m, rad].

    Raises:
        RefusalError: Names the entry and the value.
    """
    plan, start = rows.plan, rows.plan.start + displacement
    for name, expected in (
        ("object_pose", start[:3]),
        ("joints", start[3:]),
        ("object_twist", np.zeros(3)),
        ("joint_rates", np.zeros(len(start) - 3)),
        ("governor_position", plan.start[:2]),
    ):
        rows.require_same(name, expected[None], SAME)
    away = float(np.hypot(*displacement[:2])), float(np.abs(displacement[2:]).max())
    if (budget := plan.budget) is not None:
        most = budget.position_noise, budget.angle_noise if budget.axes else np.inf
        for name, found, allowed in zip(("object_pose[0]", "joints[0]"), away, most, strict=True):
            if not found <= allowed + SAME:
                told = f"is off the plan's start by {found:.6g} m or rad; the budget has {allowed:.6g}"
                raise RefusalError(name, told)
    return Check("the run begins at rest, at the plan's start", 1, away[0], "m from the plan's start")


def check_arrival(rows: Rows, problem: PlanningProblem) -> Check:
    """Check that the run states its arrival, and that it ends at the goal within the tolerances.

    Raises:
        RefusalError: Names the entry and the value.
    """
    log, plan = rows.log, rows.plan
    if not log.reached or log.violation:
        raise RefusalError("reached", f"is {log.reached}: {log.violation or 'the run did not arrive'}")
    last = len(log.times) - 1
    away = float(np.hypot(*(rows.z[-1, :2] - plan.goal_pose[:2])))
    if not away <= problem.position_tolerance:
        allowed = f"{problem.position_tolerance} m are tolerated"
        raise RefusalError(f"object_pose[{last}]", f"is {away:.6g} m from the goal; {allowed}")
    goals = (float(plan.goal_pose[2]), *plan.goal_joints)
    tolerances = (problem.angle_tolerance, *[problem.joint_tolerance] * len(plan.goal_joints))
    for axis, (goal, tolerance) in enumerate(zip(goals, tolerances, strict=True)):
        if goal is not None and not abs(rows.z[-1, 2 + axis] - goal) <= tolerance:
            name = f"object_pose[{last}, 2]" if axis == 0 else f"joints[{last}, {axis - 1}]"
            found = f"is {rows.z[-1, 2 + axis]:.6g}; the goal is {goal} within {tolerance}"
            raise RefusalError(name, found)
    return Check("the run ends at the goal", 1, away, "m from the goal's position")
