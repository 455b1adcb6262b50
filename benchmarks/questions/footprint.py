"""The compiled footprint check as a function of numbers, for other planners."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coop_drake.answers import PlanningProblem
from coop_drake.compiled import prepared
from coop_drake.planning.sampling.collision import grid_for_team, is_free
from coop_drake.tree.pose import FloatArray

__all__ = ["free_goals", "prepared_check"]

_TRIES_PER_GOAL = 40
"""Random values of the free joints that are tried for each goal configuration."""


def prepared_check(problem: PlanningProblem) -> Callable[..., bool]:
    """Prepare ``check(x, y, theta, q...)`` for one question: is this configuration free?

    The team and the floor are handed over once, which makes a call three times as quick.
    """
    team = problem.tree.arrays
    grid = grid_for_team(problem.workspace, team)
    check = prepared(is_free, (team, grid), problem.start.astype(float), 0.0)
    return lambda *values: check(np.array(values), 0.0)


def free_goals(problem: PlanningProblem, check: Callable[..., bool], count: int, seed: int) -> FloatArray:
    """Free configurations at the goal, with random values of the free joints; shape (m <= count, 3 + n).

    Args:
        problem: The question.
        check: Its compiled check.
        count: How many are wanted.
        seed: Seed of the random joints.
    """
    random = np.random.default_rng(seed)
    lower, upper = problem.tree.range_lower, problem.tree.range_upper
    fixed = np.array([np.nan if value is None else value for value in problem.goal_joints], dtype=float)
    goals: list[FloatArray] = []
    for _ in range(_TRIES_PER_GOAL * count):
        joints = lower + random.random(len(fixed)) * (upper - lower)
        goal = np.concatenate((problem.goal_pose, np.where(np.isnan(fixed), joints, fixed)))
        if check(*map(float, goal)):
            goals.append(goal)
        if len(goals) == count or not np.isnan(fixed).any():
            break
    return np.array(goals).reshape(-1, 3 + len(fixed))
