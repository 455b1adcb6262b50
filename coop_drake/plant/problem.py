"""Builds the planning problem from a scenario and its plant."""

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.problem import PlanningProblem
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.team import TeamPlant, build_team_plant
from coop_drake.plant.validation import check_joints, check_places
from coop_drake.scenario import Scenario
from coop_drake.tree.pose import FloatArray


def planning_problem(scenario: Scenario, team: TeamPlant | None = None) -> PlanningProblem:
    """Put start, goal, walls and bodies together, and refuse inputs that are certainly mistakes.

    Args:
        scenario: The scenario.
        team: The plant that was built from it; None to build it here.

    Raises:
        ScenarioError: Models that make no team, joints that do not fit the robots or their limits, a start in
            collision, a goal where the object leaves the floor, or bodies whose footprint cannot be read.
    """
    if team is None:
        team = build_team_plant(scenario, DiagramBuilder())
    check_joints(scenario, team)
    problem = PlanningProblem(
        workspace=scenario.workspace.polygon,
        tree=read_component_tree(team),
        start=start_configuration(scenario, team),
        goal_pose=np.array([scenario.goal.object.x, scenario.goal.object.y, scenario.goal.object.theta]),
        goal_joints=tuple(
            value
            for robot in team.robots
            for value in scenario.goal.joints.get(robot.name, (None,) * len(robot.joints))
        ),
        position_tolerance=scenario.goal.tolerances.position,
        angle_tolerance=scenario.goal.tolerances.angle,
        joint_tolerance=scenario.goal.tolerances.joint,
        settings=scenario.planner,
    )
    check_places(scenario, problem)
    return problem


def start_configuration(scenario: Scenario, team: TeamPlant) -> FloatArray:
    """The start as z = (x, y, theta, q...), shape (3 + n,) [m, rad]; joints must have been checked."""
    start = scenario.start.object
    joints = [value for robot in team.robots for value in scenario.start.joints.get(robot.name, ())]
    return np.array([start.x, start.y, start.theta, *joints])
