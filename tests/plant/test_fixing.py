"""Joints that a scenario fixes: they become welds at their place, by name or by pattern, in every plant."""

from __future__ import annotations

import numpy as np
import pytest

from coop_drake.cli.task import read_task
from coop_drake.errors import ScenarioError
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import exchanged, team_of, write_with_robot
from tests.support.robot_dynamics import robot_dynamics
from tests.support.robot_models import Arm, urdf_arm

UP, ACROSS, LIFT = ("revolute", "0 0 1", ""), ("revolute", "0 1 0", ""), ("prismatic", "0 0 1", "")


def fixing(folder, arm, fixed, joints="[0.0]", ending="sdf", *pairs):
    text = arm if isinstance(arm, str) else arm.text()
    path = write_with_robot(folder, text, ending, ("robot_0: [0.0]", f"robot_0: {joints}"), *pairs)
    path.write_text(path.read_text() + f"\nfixed_joints: {{robot_0: {fixed}}}\n")
    return path


def names(team):
    return [name for name in team.joint_names if name.startswith("robot_0")]


def test_a_joint_that_leaves_the_plane_is_refused_with_its_name_until_it_is_fixed(tmp_path):
    arm = Arm(joints=(UP, ACROSS))
    scenario = load_scenario(write_with_robot(tmp_path, arm.text()))
    with pytest.raises(ScenarioError, match=r"'robot_0::joint_1'.*a value for it under fixed_joints.robot_0"):
        team_of(scenario)
    team, _ = team_of(load_scenario(fixing(tmp_path, arm, "{joint_1: 0}")))
    assert names(team) == ["robot_0::joint_0"]


@pytest.mark.parametrize("value", [0.0, 0.3, -1.1])
def test_a_fixed_joint_stands_at_its_value(tmp_path, value):
    """The base hangs where the same arm would hold it with that joint there."""
    arm = Arm(joints=(UP, UP))
    fixed, _ = team_of(load_scenario(fixing(tmp_path, arm, f"{{joint_1: {value}}}")))
    free, _ = team_of(load_scenario(write_with_robot(tmp_path, arm.text())))
    poses = []
    for team, joint in ((fixed, None), (free, "joint_1")):
        context = team.plant.CreateDefaultContext()
        if joint:
            team.plant.GetJointByName(joint).set_angle(context, value)
        poses.append(team.robots[0].base_body.EvalPoseInWorld(context))
    assert poses[0].IsNearlyEqualTo(poses[1], 1e-12)


def test_patterns_fix_all_but_what_is_named_null(tmp_path):
    arm = Arm(joints=(UP, ACROSS, UP, ACROSS))
    team, _ = team_of(load_scenario(fixing(tmp_path, arm, '{"joint_*": 0, joint_2: null}')))
    assert names(team) == ["robot_0::joint_2"]
    team, _ = team_of(load_scenario(fixing(tmp_path, arm, '{"joint_?": 0, joint_0: 0.5}')))
    assert names(team) == []


def test_the_robots_own_plant_has_the_same_joints_and_masses(tmp_path):
    scenario = load_scenario(fixing(tmp_path, Arm(joints=(UP, LIFT)), "{joint_1: 0.1}"))
    alone = robot_dynamics(scenario, 0)
    assert [joint.name() for joint in alone.joints] == ["joint_0"]
    alone.set_state(np.zeros(4), np.zeros(4))
    assert alone.mass_matrix().shape == (4, 4)
    assert alone.mass_matrix()[0, 0] == pytest.approx(8.0)


def test_other_kinds_of_joints_are_fixed_at_zero(tmp_path):
    path = fixing(tmp_path, urdf_arm("planar"), "{yaw: 0}", "[0.1]", "urdf")
    team, _ = team_of(load_scenario(path))
    assert names(team) == ["robot_0::reach"]
    path.write_text(exchanged(path.read_text(), ("{yaw: 0}", "{yaw: 0.5}")))
    with pytest.raises(ScenarioError, match="0, the only place where a planar joint can be fixed"):
        team_of(load_scenario(path))


def test_footprints_are_those_of_the_fixed_place(tmp_path):
    """A link of 0.4 m that is lifted by 60 degrees covers half its length on the floor."""
    path = fixing(tmp_path, Arm(joints=(UP, ACROSS)), "{joint_1: 1.0472}")
    level = "{base_frame: robot_0::gripper, rotation: !Rpy {deg: [0, 60, 0]}}"
    weld = "- add_weld: {parent: object::grasp_0, child: robot_0::gripper}"
    upright = weld.replace("robot_0::gripper", "level")
    frame = f"- add_frame: {{name: level, X_PF: {level}}}"
    text = exchanged(path.read_text(), (weld, f"{frame}\n{upright}"))
    path.write_text(text)
    problem = read_task(path, None).problem
    (link,) = [b for c in problem.tree.components for b in c.bodies if b.name == "robot_0::link_2"]
    width = np.ptp(np.vstack([shape.vertices for shape in link.shapes]), axis=0).max()
    assert width == pytest.approx(0.4 * 0.5 + 0.1 * np.sin(np.pi / 3), abs=1e-3)


REFUSED = {
    "no such joint": ("{wheel: 0}", r"fixed_joints.robot_0.wheel", "a joint that can move, or a pattern"),
    "no match": ('{"*wheel*": 0}', r"fixed_joints.robot_0.*wheel*", "joint_0, joint_1"),
    "twice": ('{"joint*": 0, "*_1": 0}', r"fixed_joints.robot_0.*_1", "one pattern for joint_1"),
    "beyond its limits": ("{joint_1: 2.0}", r"fixed_joints.robot_0.joint_1", "between the joint's limits"),
}


@pytest.mark.parametrize(("fixed", "key", "allowed"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_fixed_is_refused(tmp_path, fixed, key, allowed):
    with pytest.raises(ScenarioError) as caught:
        team_of(load_scenario(fixing(tmp_path, Arm(joints=(UP, UP)), fixed)))
    assert caught.value.key == key
    assert allowed in caught.value.allowed


def test_an_unknown_robot_is_refused(tmp_path):
    path = fixing(tmp_path, Arm(), "{}")
    path.write_text(exchanged(path.read_text(), ("fixed_joints: {robot_0:", "fixed_joints: {robot_7:")))
    with pytest.raises(ScenarioError, match=r"fixed_joints.robot_7: 'robot_7'.*robot_0, robot_1"):
        load_scenario(path)
