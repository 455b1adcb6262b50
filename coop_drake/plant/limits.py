"""Reads the largest speeds of bases and joints from the models of the robots."""

from __future__ import annotations

from math import inf

import numpy as np

from coop_drake.answers.limits import TeamLimits
from coop_drake.plant.parsing import refusal
from coop_drake.plant.planarity import planar_pose
from coop_drake.plant.team import RobotModel, TeamPlant
from coop_drake.tree.component_tree import ComponentTree


def read_limits(team: TeamPlant, tree: ComponentTree) -> TeamLimits:
    """Read velocity limits of the joints, and where the bases' frames are.

    Raises:
        ScenarioError: A joint cannot move because its velocity limit is zero.
    """
    components = tuple(_base_component(team, tree, robot) for robot in team.robots)
    poses = tree.poses(np.zeros(3 + len(tree.joints)))
    context = team.plant.CreateDefaultContext()
    team.plant.SetPositions(context, np.zeros(team.plant.num_positions()))
    placed = [planar_pose(robot.base_body.EvalPoseInWorld(context)) for robot in team.robots]
    points = [
        poses[component].inverse().apply(np.array([[pose.x, pose.y]]))[0]
        for component, pose in zip(components, placed, strict=True)
    ]
    unknown = np.full(len(team.robots), inf)
    return TeamLimits(
        base_components=components,
        base_points=tuple((float(x), float(y)) for x, y in points),
        base_speeds=unknown,
        turn_rates=unknown.copy(),
        joint_rates=np.array([rate for robot in team.robots for rate in _joint_rates(team, robot)]),
    )


def _base_component(team: TeamPlant, tree: ComponentTree, robot: RobotModel) -> int:
    """Index of the component of a base: the last one that a joint between object and base moves."""
    joints = dict(zip(robot.joint_names, robot.joints, strict=True))
    base, moving = robot.base_body.index(), 0
    for index, component in enumerate(tree.components):  # parents before children
        joint = None if component.joint is None else joints.get(component.joint.name)
        if joint is not None and base in team.plant.GetBodiesKinematicallyAffectedBy([joint.index()]):
            moving = index
    return moving


def _joint_rates(team: TeamPlant, robot: RobotModel) -> list[float]:
    rates = []
    for joint, name in zip(robot.joints, robot.joint_names, strict=True):
        rate = float(min(-joint.velocity_lower_limits()[0], joint.velocity_upper_limits()[0]))
        if not rate > 0.0:
            models = team.assembly.robots[robot.index]
            allowed = f"a velocity limit above zero, not {rate + 0.0:g}; or a value under fixed_joints"
            raise refusal(team.scenario, models, name, allowed)
        rates.append(rate)
    return rates
