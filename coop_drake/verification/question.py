"""Whether a plan answers this question: the same joints, start and goal, the same floor and team."""

from __future__ import annotations

from math import remainder, tau

import numpy as np

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.verification.checks import Check

__all__ = ["check_question", "same_question"]

WHOLE_TURNS = 1e-9
"""Rounding of the goal's angle unwrapped along a plan [rad]."""


def same_question(digest: str, problem: PlanningProblem) -> None:
    """Refuse a document that was written for another floor, team, start or goal.

    Raises:
        RefusalError: Names both digests.
    """
    expected = problem_digest(problem)
    if digest != expected:
        raise RefusalError("problem", f"{digest!r} is not the scenario's digest, '{expected}'")


def check_question(plan: Plan, problem: PlanningProblem) -> Check:
    """Compare what the plan says about its question with the question.

    Raises:
        RefusalError: Names the entry and both values.
    """
    names = tuple(joint.name for joint in problem.tree.joints)
    if plan.joint_names != names:
        raise RefusalError("joint_names", f"{list(plan.joint_names)} are not the scenario's, {list(names)}")
    if not np.array_equal(plan.start, problem.start):
        raise RefusalError("start", f"{plan.start.tolist()} is not the scenario's, {problem.start.tolist()}")
    if plan.goal_joints != problem.goal_joints:
        raise RefusalError(
            "goal_joints", f"{list(plan.goal_joints)} are not the scenario's, {list(problem.goal_joints)}"
        )
    turned = remainder(float(plan.goal_pose[2] - problem.goal_pose[2]), tau)
    if not np.array_equal(plan.goal_pose[:2], problem.goal_pose[:2]) or abs(turned) > WHOLE_TURNS:
        raise RefusalError(
            "goal_pose", f"{plan.goal_pose.tolist()} is not the scenario's, {problem.goal_pose.tolist()}"
        )
    same_question(plan.problem, problem)
    return Check("question is the scenario's: floor, team, start, goal, tolerances", 1)
