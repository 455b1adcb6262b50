"""The team's plant: one tree at the object, exact grasps, torques in q's order."""

import numpy as np
import pytest

from coop_drake.plant import base_poses, set_configuration
from coop_drake.scenario import load_scenario
from coop_drake.tree.pose import PlanarPose
from tests.support.cases import GRASPS
from tests.support.configuration import get_configuration, get_rates
from tests.support.edited_scenario import MODELS, exchanged, shipped, team_of, write_edited, write_with_robot
from tests.support.robot_models import Arm


def some_state(team, seed=5):
    rng = np.random.default_rng(seed)
    size = 3 + len(team.joints)
    return rng.uniform(-0.2, 0.2, size), rng.uniform(-1.0, 1.0, size)


def test_coordinates_are_the_object_and_the_joints_and_nothing_else(team):
    assert team.plant.num_positions() == 3 + len(team.joints)
    assert sorted(team.position_index) == list(range(team.plant.num_positions()))
    assert sorted(team.velocity_index) == list(range(team.plant.num_velocities()))
    assert team.plant.time_step() == 0.0
    assert team.plant.gravity_field().gravity_vector() == pytest.approx([0.0, 0.0, 0.0])


def test_configuration_and_rates_come_back_as_they_were_set(team):
    context = team.plant.CreateDefaultContext()
    z, z_rate = some_state(team)
    set_configuration(team, context, z, z_rate)
    assert get_configuration(team, context) == pytest.approx(z)
    assert get_rates(team, context) == pytest.approx(z_rate)
    set_configuration(team, context, z)
    assert get_rates(team, context) == pytest.approx(np.zeros(len(z)))


def test_object_pose_in_the_plant_is_the_configuration(team):
    context = team.plant.CreateDefaultContext()
    set_configuration(team, context, np.array([1.0, 2.0, 0.7, *np.zeros(len(team.joints))]))
    X_WL = team.object_frame.CalcPoseInWorld(context)
    assert X_WL.translation() == pytest.approx([1.0, 2.0, 0.0])
    assert X_WL.rotation().ToRollPitchYaw().vector() == pytest.approx([0.0, 0.0, 0.7])


def test_torques_enter_in_the_order_of_q(team):
    actuation = team.plant.MakeActuationMatrix()[team.velocity_index]
    assert actuation == pytest.approx(np.eye(3 + len(team.joints))[:, 3:])


def test_grasps_are_where_the_object_offers_them():
    team, _builder = team_of(shipped("three"))
    for robot, grasp in zip(team.robots, GRASPS, strict=False):
        assert (robot.X_LE.x, robot.X_LE.y) == pytest.approx((grasp.x, grasp.y))
        assert np.cos(robot.X_LE.angle - grasp.angle) == pytest.approx(1.0)


def test_straight_arms_put_the_bases_in_line():
    team, _builder = team_of(shipped("base"))
    context = team.plant.CreateDefaultContext()
    set_configuration(team, context, np.zeros(5))
    poses = base_poses(team, context)
    assert poses[:, :2] == pytest.approx(np.array([[1.15, 0.0], [-1.15, 0.0]]), abs=1e-12)
    assert abs(poses[0, 2]) == pytest.approx(np.pi)
    assert poses[1, 2] == pytest.approx(0.0)


def test_masses_are_those_of_the_cases():
    team, _builder = team_of(shipped("three"))
    context = team.plant.CreateDefaultContext()
    assert team.object_inertia.mass == pytest.approx(1.0)
    assert team.object_inertia.inertia_about_com == pytest.approx(1.0)
    assert team.object_inertia.p_LLcm == pytest.approx([0.0, 0.0])
    for robot in team.robots:
        bodies = [team.plant.get_body(i) for i in team.plant.GetBodyIndices(robot.model_instance)]
        assert {b.name(): b.get_mass(context) for b in bodies} == pytest.approx(
            {"base": 6.0, "link_1": 1.0, "link_2": 1.0}
        )


def test_inertia_of_an_object_whose_mass_lies_off_its_frame(tmp_path):
    text = exchanged(
        (MODELS / "object.sdf").read_text(), ("<pose>0 0 0 0 0 0</pose>", "<pose>0.1 -0.05 0 0 0 0</pose>")
    )
    path = write_edited(tmp_path, ("package://coop_drake_models/object.sdf", "heavy.sdf"), heavy_sdf=text)
    team, _builder = team_of(load_scenario(path))
    assert team.object_inertia.p_LLcm == pytest.approx([0.1, -0.05])
    assert team.object_inertia.inertia_about_com == pytest.approx(1.0)


def test_weld_offset_moves_the_grasp(tmp_path):
    weld = "{parent: object::grasp_0, child: robot_0::gripper"
    turned = "{parent: robot_0::gripper, child: object::grasp_0"
    offset = ", X_PC: {translation: [0.02, 0.05, 0], rotation: !Rpy {deg: [0, 0, 10]}}}"
    team, _one = team_of(load_scenario(write_edited(tmp_path, (weld + "}", weld + offset))))
    expected = PlanarPose(0.42, 0.05, np.deg2rad(10.0))
    found = team.robots[0].X_LE
    assert (found.x, found.y, found.angle) == pytest.approx((expected.x, expected.y, expected.angle))
    other, _two = team_of(load_scenario(write_edited(tmp_path, (weld + "}", turned + offset))))
    back = PlanarPose(0.4) @ PlanarPose(0.02, 0.05, np.deg2rad(10.0)).inverse()
    found = other.robots[0].X_LE
    assert (found.x, found.y, found.angle) == pytest.approx((back.x, back.y, back.angle))


def test_efforts_and_rotors_that_a_file_states_are_kept(tmp_path):
    limits = "<limit><lower>-1</lower><upper>1</upper><effort>{}</effort></limit>"
    for stated, kept in (("3", 3.0), ("0", np.inf)):
        arm = Arm(joints=(("revolute", "0 0 1", limits.format(stated)),)).text()
        team, _builder = team_of(load_scenario(write_with_robot(tmp_path, arm)))
        actuators = [team.plant.get_joint_actuator(i) for i in team.plant.GetJointActuatorIndices()]
        assert [actuator.effort_limit() for actuator in actuators] == [kept, np.inf]


def test_robot_of_two_models_is_one_robot(tmp_path):
    hand = (
        "<sdf version='1.9'><model name='hand'><link name='palm'><collision name='c'><geometry><sphere>"
        "<radius>0.05</radius></sphere></geometry></collision></link>"
        "<frame name='tip'><pose>0.1 0 0 0 0 0</pose></frame></model></sdf>"
    )
    model = "{name: robot_0, file: package://coop_drake_models/long_blue.sdf}"
    weld = "- add_weld: {parent: object::grasp_0, child: robot_0::gripper}"
    path = write_edited(
        tmp_path,
        (f"add_model: {model}", f"add_model: {model}\n- add_model: {{name: hand, file: hand.sdf}}"),
        (
            weld,
            weld.replace("robot_0::gripper", "hand::tip")
            + "\n- add_weld: {parent: robot_0::gripper, child: hand::palm}",
        ),
        hand_sdf=hand,
    )
    team, _builder = team_of(load_scenario(path))
    assert [robot.name for robot in team.robots] == ["robot_0", "robot_1"]
    assert team.robots[0].joint_names == ("robot_0::elbow",)
    assert team.robots[0].gripper_frame.name() == "tip"


def test_torques_saturate_at_the_effort_that_a_file_states(tmp_path):
    arm = Arm(
        joints=(("revolute", "0 0 1", "<limit><lower>-1</lower><upper>1</upper><effort>3</effort></limit>"),)
    )
    team, builder = team_of(load_scenario(write_with_robot(tmp_path, arm.text())))
    root = builder.Build().CreateDefaultContext()
    context = team.plant.GetMyMutableContextFromRoot(root)
    port = team.plant.get_generalized_acceleration_output_port()
    team.plant.get_actuation_input_port().FixValue(context, [3.0, 0.0])
    at_limit = port.Eval(context).copy()
    team.plant.get_actuation_input_port().FixValue(context, [10.0, 0.0])
    assert port.Eval(context) == pytest.approx(at_limit)
    assert np.abs(at_limit).max() > 1.0
