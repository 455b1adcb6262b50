"""The planning problem that a scenario states about a team whose component tree is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from coop_drake.answers.limits import TeamLimits
from coop_drake.answers.problem import PlanningProblem
from coop_drake.scenario.limits import ALL_ROBOTS, RobotLimits
from coop_drake.scenario.model import Scenario
from coop_drake.tree.component_tree import ComponentTree


def stated_problem(
    scenario: Scenario, tree: ComponentTree, joints: Mapping[str, int], limits: TeamLimits
) -> PlanningProblem:
    """Put floor, team, start and goal together.

    Args:
        scenario: The scenario; its joint values have been checked, or will be.
        tree: The team as seen from the object.
        joints: The robots in their order, each with its number of joints.
        limits: What the models say about limits.
    """
    start, goal = scenario.start, scenario.goal
    values = [value for robot in joints for value in start.joints.get(robot, ())]
    return PlanningProblem(
        workspace=scenario.workspace.polygon,
        tree=tree,
        start=np.array([start.object.x, start.object.y, start.object.theta, *values]),
        goal_pose=np.array([goal.object.x, goal.object.y, goal.object.theta]),
        goal_joints=tuple(
            value for robot, count in joints.items() for value in goal.joints.get(robot, (None,) * count)
        ),
        position_tolerance=goal.tolerances.position,
        angle_tolerance=goal.tolerances.angle,
        joint_tolerance=goal.tolerances.joint,
        settings=scenario.planner,
        limits=_stated_limits(scenario, joints, limits),
    )


def _stated_limits(scenario: Scenario, joints: Mapping[str, int], limits: TeamLimits) -> TeamLimits:
    """Limits of the models with those that the scenario states in their place."""
    speeds, turns = limits.base_speeds.copy(), limits.turn_rates.copy()
    rates, accelerations = limits.joint_rates.copy(), limits.joint_accelerations.copy()
    first = 0
    for k, (robot, count) in enumerate(joints.items()):
        stated = scenario.limits.get(robot, scenario.limits.get(ALL_ROBOTS, RobotLimits()))
        speeds[k] = speeds[k] if stated.base_speed is None else stated.base_speed
        turns[k] = turns[k] if stated.base_turn_rate is None else stated.base_turn_rate
        for values, given in ((rates, stated.joint_rates), (accelerations, stated.joint_accelerations)):
            for i, value in enumerate(given * count if len(given) == 1 else given):
                values[first + i] = values[first + i] if value is None else value
        first += count
    return replace(
        limits, base_speeds=speeds, turn_rates=turns, joint_rates=rates, joint_accelerations=accelerations
    )
