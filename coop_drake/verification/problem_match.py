"""Check that a plan or a proof is about this problem: the same floor, team, start, goal and tolerances."""

from __future__ import annotations

from math import remainder, tau

import numpy as np

from coop_drake.answers.belonging import same_goal_joints
from coop_drake.answers.digest import problem_digest
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.verification.checks import Check

SAME_ANGLE = 1e-9
"""Two angles that differ by this, whole turns aside, are one angle that was rounded [rad]."""


def same_angle(first: float, second: float) -> bool:
    """Whether two angles are the same up to whole turns and rounding [rad]."""
    return abs(remainder(float(first - second), tau)) <= SAME_ANGLE


def check_digest(digest: str, problem: PlanningProblem) -> None:
    """Refuse a document that was written for another floor, team, start or goal.

    Raises:
        RefusalError: Names both digests.
    """
    expected = problem_digest(problem)
    if digest != expected:
        raise RefusalError("problem", f"{digest!r} is not the scenario's digest, '{expected}'")


def check_problem(plan: Plan, problem: PlanningProblem) -> Check:
    """Compare a plan's own statement of its problem with the problem.

    Raises:
        RefusalError: Names the entry and both values.
    """
    goal, stated = problem.goal_pose, plan.goal_pose
    names = [joint.name for joint in problem.tree.joints]
    same_goal = np.array_equal(stated[:2], goal[:2]) and same_angle(stated[2], goal[2])
    for where, same, found, expected in (
        ("joint_names", list(plan.joint_names) == names, list(plan.joint_names), names),
        ("start", np.array_equal(plan.start, problem.start), plan.start.tolist(), problem.start.tolist()),
        (
            "goal_joints",
            same_goal_joints(plan, problem),
            list(plan.goal_joints),
            list(problem.goal_joints),
        ),
        ("goal_pose", same_goal, stated.tolist(), goal.tolist()),
    ):
        if not same:
            raise RefusalError(where, f"{found} is not the scenario's, {expected}")
    check_digest(plan.problem, problem)
    return Check("the problem is the scenario's: floor, team, start, goal, tolerances", 1)
