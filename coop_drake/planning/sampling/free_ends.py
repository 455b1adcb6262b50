"""A free end within the goal's tolerances, where the middle of the goal is not free."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.problem import PlanningProblem, at_goal, goal_box
from coop_drake.errors import GeometryError
from coop_drake.planning.questions.endings import ending_at, within_limits
from coop_drake.planning.questions.margins import shrunk
from coop_drake.planning.sampling.collision_kernels import is_free
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid, grid_for_team
from coop_drake.tree.pose import FloatArray

ENDS, TRIED = 64, 16
"""Ends that are tried, and values of the free joints that are tried at each [-]."""

DISTANCES = (0.015, 0.005, 0.002, 0.0)
"""Distances from walls that an end shall keep, in the order tried [m]."""

WITHIN = 0.9
"""Share of the tolerances that ends lie in, so that some of them is left about an end [-]."""


def ending_freely(problem: PlanningProblem) -> PlanningProblem | None:
    """The question of ending at a free configuration of the goal, if one is found and its middle is not free.

    A middle that is nearer to walls than ``planner.min_clearance`` is left for an end that is not. Of ends
    that keep the same distance from walls it is the one about which most of the tolerances is left.
    """
    middle, random = within_limits(problem), np.random.default_rng(0)
    middles, least = _ends(problem, random, 0.0), problem.settings.min_clearance
    free = middle is problem and len(_free(problem, middles, 0.0)) > 0
    if free and _free(problem, middles, least):
        return None
    ends = _ends(problem, random, WITHIN)
    for distance in DISTANCES:
        if free and distance < least:
            return None
        asked = [ending_at(problem, end) for end in _free(problem, ends, distance)]
        if asked:
            return max(asked, key=lambda one: _left(one, problem))
    return None


def _ends(problem: PlanningProblem, random: np.random.Generator, share: float) -> FloatArray:
    """Configurations in a share of the goal, or in its middle, with values of the free joints, (k, 3 + n)."""
    low, high = np.array(goal_box(problem)).T
    aimed = np.array([True, *[goal is not None for goal in problem.goal_joints]])
    middle = at_goal(problem.goal_pose, problem.goal_joints, 0.0)[2:] if share == 0.0 else 0.5 * (low + high)
    spread = np.repeat(random.uniform(-share, share, (ENDS, len(low))), TRIED, axis=0)
    spread[:, ~aimed] = random.uniform(-1.0, 1.0, (ENDS * TRIED, int((~aimed).sum())))
    axes = np.where(aimed, middle, 0.5 * (low + high)) + 0.5 * (high - low) * spread
    away = problem.position_tolerance * share * np.sqrt(random.random(ENDS))
    turn = random.uniform(0.0, 2.0 * np.pi, ENDS)
    places = problem.goal_pose[:2] + np.column_stack((away * np.cos(turn), away * np.sin(turn)))
    return np.column_stack((np.repeat(places, TRIED, axis=0), axes))


def _free(problem: PlanningProblem, ends: FloatArray, distance: float) -> list[FloatArray]:
    """Those of some ends that are free and keep a distance from walls [m]."""
    team = problem.tree.arrays
    try:
        grid: ObstacleGrid = grid_for_team(shrunk(problem.workspace, distance), team)
    except GeometryError:
        return []
    return [end for end in ends if is_free(team, grid, end, 0.0)]


def _left(asked: PlanningProblem, problem: PlanningProblem) -> float:
    """The least share of a tolerance that is left about an end [-]."""
    joints = np.asarray(asked.joint_tolerance) / problem.joint_tolerance
    position = asked.position_tolerance / problem.position_tolerance
    angle = asked.angle_tolerance / problem.angle_tolerance
    return float(min(position, angle, joints.min(initial=1.0)))
