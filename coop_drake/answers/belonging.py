"""Whether a plan was made for a planning problem, and for the age of a team's commands."""

from __future__ import annotations

from math import isclose, remainder, tau
from pathlib import Path

import numpy as np

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import PlanError
from coop_drake.laws.gains import GainSet, ScheduledGains

_SAME_GOAL = 1e-9
"""Difference of goals that rounding explains: an unwrapped angle may be turned by whole turns [m, rad]."""


def check_plan_belongs(plan: Plan, problem: PlanningProblem, path: Path) -> None:
    """Refuse a plan, read from the file at ``path``, that was made for another problem.

    Raises:
        PlanError: Names the first key in which they differ, its value, and the scenario's.
    """
    away = plan.goal_pose - problem.goal_pose
    away[2] = remainder(away[2], tau)
    same_goal = same_goal_joints(plan, problem) and np.abs(away).max() <= _SAME_GOAL
    names = tuple(joint.name for joint in problem.tree.joints)
    digest = problem_digest(problem)
    checks = (
        ("joint_names", plan.joint_names == names, _listed(plan.joint_names), _listed(names), ""),
        ("start", np.array_equal(plan.start, problem.start), plan.start.tolist(), problem.start.tolist(), ""),
        ("goal_pose", same_goal, *(_goal(question) for question in (plan, problem)), ""),
        (
            "problem",
            plan.problem == digest,
            repr(plan.problem),
            repr(digest),
            ": the plan was made for another floor, team or tolerance",
        ),
    )
    for key, same, found, expected, reason in checks:
        if not same:
            raise PlanError(
                f"{path}: {key}: {found} is not allowed; expected the scenario's, {expected}{reason}"
            )


def same_goal_joints(plan: Plan, problem: PlanningProblem) -> bool:
    """Whether a plan ends at the problem's values of the joints, those without limits modulo whole turns."""
    if len(plan.goal_joints) != len(problem.goal_joints):
        return False
    goals = zip(problem.tree.joints, plan.goal_joints, problem.goal_joints, strict=True)
    return all(
        abs(remainder(ours - theirs, tau)) <= _SAME_GOAL
        if joint.circular and ours is not None and theirs is not None
        else ours == theirs
        for joint, ours, theirs in goals
    )


def other_age(plan: Plan, gain_set: GainSet | None) -> str:
    """Say that a plan's gains are for another age of commands than the gain set's; empty where they are not.

    A plan belongs to its deployment: delay, control rate, losses and lag make commands older.

    Args:
        plan: The plan.
        gain_set: The scenario's gain set that the plan names; None where it has none.
    """
    if not isinstance(gain_set, ScheduledGains):
        return ""
    first = plan.transitions[0]
    factor = plan.age_factor * (1.0 if first.tolerance is None else first.tolerance.age_factor)
    expected = min(gain_set.age_phase / (factor * gain_set.age), gain_set.max_rate_gain)
    if isclose(first.gains.rate_gain, expected, rel_tol=_SAME_GOAL):
        return ""
    found = gain_set.age_phase / (factor * first.gains.rate_gain)
    return (
        f"its gains are for commands that rest on measurements {1e3 * found:.4g} ms old, and the "
        f"`deployment` and `control` of the scenario make these {1e3 * gain_set.age:.4g} ms old; "
        "`coop-drake plan` on this scenario makes the plan for it"
    )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "no joint"


def _goal(question: Plan | PlanningProblem) -> str:
    return f"{question.goal_pose.tolist()} with goal_joints {list(question.goal_joints)}"
