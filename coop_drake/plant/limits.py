"""Reads the limits of bases and joints from the models of the robots."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np
from pydrake.multibody.tree import Joint

from coop_drake.answers.limits import TeamLimits
from coop_drake.plant.parsing import refusal
from coop_drake.plant.planarity import planar_pose
from coop_drake.plant.team import RobotModel, TeamPlant
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray


def read_limits(team: TeamPlant, tree: ComponentTree) -> TeamLimits:
    """Read the limits of the joints, and where the bases' frames are.

    Raises:
        ScenarioError: A joint cannot move because a limit is zero.
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
    unknown, joints = np.full(len(team.robots), inf), _moving(team)
    return TeamLimits(
        base_components=components,
        base_points=tuple((float(x), float(y)) for x, y in points),
        base_speeds=unknown,
        turn_rates=unknown.copy(),
        joint_rates=_of_joints(team, joints, "velocity"),
        joint_accelerations=_of_joints(team, joints, "acceleration"),
        joint_efforts=np.array([_effort(team, joint) for _, joint, _ in joints]),
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


def _moving(team: TeamPlant) -> list[tuple[RobotModel, Joint, str]]:
    """Return all joints in the order of q, each with its robot and its name."""
    return [
        (robot, joint, name)
        for robot in team.robots
        for joint, name in zip(robot.joints, robot.joint_names, strict=True)
    ]


def _of_joints(team: TeamPlant, joints: Sequence[tuple[RobotModel, Joint, str]], kind: str) -> FloatArray:
    """Return the smaller magnitude of the lower and the upper limit of every joint; infinity for none."""
    limits = []
    for robot, joint, name in joints:
        lower, upper = (
            getattr(joint, f"{kind}_lower_limits")()[0],
            getattr(joint, f"{kind}_upper_limits")()[0],
        )
        limits.append(float(min(-lower, upper)))
        if not limits[-1] > 0.0:
            models = team.assembly.robots[robot.index]
            allowed = f"a {kind} limit above zero, not {limits[-1] + 0.0:g}; or a value under fixed_joints"
            raise refusal(team.scenario, models, name, allowed)
    return np.array(limits)


def _effort(team: TeamPlant, joint: Joint) -> float:
    """Return the effort limit of a joint's motor, infinity for none [N m or N]."""
    plant = team.plant
    motors = (plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices())
    return min((float(m.effort_limit()) for m in motors if m.joint().index() == joint.index()), default=inf)
