"""The question of ending at one configuration of the goal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coop_drake.answers.problem import PlanningProblem, at_goal, goal_box
from coop_drake.tree.circles import nearest_turn
from coop_drake.tree.pose import FloatArray

SAME_END = 1e-9
"""Ends that differ by less in every axis are one end that was rounded [m, rad]."""


def ending_at(problem: PlanningProblem, end: FloatArray) -> PlanningProblem:
    """The question of ending at one configuration of the goal, with what the tolerances leave about it.

    Args:
        problem: The question.
        end: z, in the goal; what it says of joints without a goal does not matter, shape (3 + n,) [m, rad].

    Returns:
        The question; the same one if it is the middle of the goal.
    """
    goal = at_goal(problem.goal_pose, problem.goal_joints, end[3:])
    away = end - goal
    away[2:] = np.where(problem.tree.circular, [nearest_turn(angle) for angle in away[2:].tolist()], away[2:])
    away = np.abs(away)
    if away.max() <= SAME_END:
        return problem
    values = zip(problem.goal_joints, end[3:].tolist(), strict=True)
    return replace(
        problem,
        goal_pose=end[:3].copy(),
        goal_joints=tuple(None if goal is None else value for goal, value in values),
        position_tolerance=problem.position_tolerance - float(np.hypot(*away[:2])),
        angle_tolerance=problem.angle_tolerance - float(away[2]),
        joint_tolerance=problem.joint_tolerance - away[3:],
        roomy=False,
    )


def within_limits(problem: PlanningProblem) -> PlanningProblem:
    """The question with goals of joints that are beyond their limits moved to what these leave of them."""
    end = at_goal(problem.goal_pose, problem.goal_joints, 0.0)
    lower, upper = np.array(goal_box(problem))[1:].T.reshape(2, -1)
    known = np.array([goal is not None for goal in problem.goal_joints], dtype=bool)
    beyond = known & ((end[3:] < lower) | (end[3:] > upper))
    end[3:] = np.where(beyond, 0.5 * (lower + upper), end[3:])
    return ending_at(problem, end)
