"""The planning problem that a scenario states about a team whose component tree is known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.scenario.model import Scenario
from coop_drake.tree.component_tree import ComponentTree


def stated_problem(scenario: Scenario, tree: ComponentTree, joints: Mapping[str, int]) -> PlanningProblem:
    """Put floor, team, start and goal together.

    Args:
        scenario: The scenario; its joint values have been checked, or will be.
        tree: The team as seen from the object.
        joints: The robots in their order, each with its number of joints.
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
    )
