"""What a robot knows of its own dynamics is what the team's plant does with it."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce

from coop_drake.plant import base_poses, set_configuration
from coop_drake.scenario import load_scenario
from tests.support.edited_scenario import shipped, team_of, write_with_robot
from tests.support.robot_dynamics import robot_dynamics
from tests.support.robot_models import Arm

PLANAR = [3, 4, 2]


def moving(team, context, seed=2):
    """A state of the team within its joints' limits; z and its rates."""
    rng = np.random.default_rng(seed)
    joints = [rng.uniform(j.position_lower_limits()[0], j.position_upper_limits()[0]) for j in team.joints]
    z, z_rate = np.array([*rng.uniform(-2.0, 2.0, 3), *joints]), rng.uniform(-1.0, 1.0, 3 + len(joints))
    set_configuration(team, context, z, z_rate)
    return z, z_rate


def own_state(team, robot, context, z, z_rate):
    """(z_k, z_k') of one robot as the team's plant has them."""
    base_rate = robot.base_body.EvalSpatialVelocityInWorld(context).get_coeffs()[PLANAR]
    joints = slice(3 + robot.q_slice.start, 3 + robot.q_slice.stop)
    pose = base_poses(team, context)[robot.index]
    return np.concatenate([pose, z[joints]]), np.concatenate([base_rate, z_rate[joints]])


def test_kinetic_energies_of_object_and_robots_add_up_to_the_team_s(scenario, team):
    context = team.plant.CreateDefaultContext()
    z, z_rate = moving(team, context)
    inertia = team.object_inertia
    arm = np.array([[np.cos(z[2]), -np.sin(z[2])], [np.sin(z[2]), np.cos(z[2])]]) @ inertia.p_LLcm
    speed = z_rate[:2] + z_rate[2] * np.array([-arm[1], arm[0]])
    energy = 0.5 * inertia.mass * speed @ speed + 0.5 * inertia.inertia_about_com * z_rate[2] ** 2
    for robot in team.robots:
        own = robot_dynamics(scenario, robot.index)
        own.set_state(*own_state(team, robot, context, z, z_rate))
        rate = own_state(team, robot, context, z, z_rate)[1]
        energy += 0.5 * rate @ own.mass_matrix() @ rate
    assert energy == pytest.approx(team.plant.CalcKineticEnergy(context), rel=1e-9)


def test_grasp_moves_in_both_plants_alike(scenario, team):
    context = team.plant.CreateDefaultContext()
    z, z_rate = moving(team, context)
    for robot in team.robots:
        own = robot_dynamics(scenario, robot.index)
        own.set_state(*(state := own_state(team, robot, context, z, z_rate)))
        X_WE = robot.gripper_frame.CalcPoseInWorld(context)
        assert own.grasp_pose()[:2] == pytest.approx(X_WE.translation()[:2], abs=1e-7)
        twist = robot.gripper_frame.CalcSpatialVelocityInWorld(context).get_coeffs()[PLANAR]
        assert own.grasp_jacobian() @ state[1] == pytest.approx(twist, abs=1e-7)


def test_grasp_bias_is_the_derivative_of_the_jacobian_times_the_rates(scenario, team):
    context = team.plant.CreateDefaultContext()
    z, z_rate = moving(team, context)
    for robot in team.robots:
        own = robot_dynamics(scenario, robot.index)
        pose, rate = own_state(team, robot, context, z, z_rate)
        step, ends = 1e-6, []
        for sign in (-1.0, 1.0):
            own.set_state(pose + sign * step * rate, rate)
            ends.append(own.grasp_jacobian() @ rate)
        own.set_state(pose, rate)
        assert own.grasp_bias() == pytest.approx((ends[1] - ends[0]) / (2.0 * step), abs=1e-6)


def test_effort_is_what_moves_the_robot_and_what_its_hand_gives_away(scenario):
    """M z'' + C z' + J^T tau_e equals the base wrench and torques put in, with tau_e read from the weld."""
    team, builder = team_of(scenario)
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    plant, context = team.plant, team.plant.GetMyMutableContextFromRoot(root)
    z, z_rate = moving(team, context)
    rng = np.random.default_rng(4)
    wrenches, torques = (
        rng.uniform(-5.0, 5.0, (len(team.robots), 3)),
        rng.uniform(-2.0, 2.0, len(team.joints)),
    )
    plant.get_actuation_input_port().FixValue(context, torques)
    applied = [_at_base(robot, wrench) for robot, wrench in zip(team.robots, wrenches, strict=True)]
    plant.get_applied_spatial_force_input_port().FixValue(context, Value(applied))
    acceleration = plant.get_generalized_acceleration_output_port().Eval(context)
    spatial = plant.get_body_spatial_accelerations_output_port().Eval(context)
    on_object = team.grasps.wrenches(context)
    for robot in team.robots:
        own = robot_dynamics(scenario, robot.index)
        own.set_state(*own_state(team, robot, context, z, z_rate))
        base = spatial[int(robot.base_body.index())].get_coeffs()[PLANAR]
        joints = acceleration[[joint.velocity_start() for joint in robot.joints]]
        reaction = own.grasp_jacobian().T @ on_object[robot.index]
        effort = own.inertial_effort(np.concatenate([base, joints])) + reaction
        assert effort == pytest.approx(
            np.concatenate([wrenches[robot.index], torques[robot.q_slice]]), abs=1e-5
        )


def _at_base(robot, wrench):
    force = ExternallyAppliedSpatialForce()
    force.body_index = robot.base_body.index()
    force.p_BoBq_B = np.zeros(3)
    force.F_Bq_W = SpatialForce(np.array([0.0, 0.0, wrench[2]]), np.array([wrench[0], wrench[1], 0.0]))
    return force


def test_effort_is_mass_times_acceleration_and_bias():
    own = robot_dynamics(shipped("elbow"), 1)
    rng = np.random.default_rng(6)
    z, rate, acceleration = rng.uniform(-1.0, 1.0, (3, 5))
    own.set_state(z, rate)
    assert own.inertial_effort(acceleration) == pytest.approx(own.mass_matrix() @ acceleration + own.bias())
    assert own.mass_matrix() == pytest.approx(own.mass_matrix().T)


def test_mass_matrix_of_a_shipped_robot_by_hand():
    """Straight arm: 8 kg; base, link 1 and link 2 at 0, 0.175 and 0.56 m from the base."""
    own = robot_dynamics(shipped("base"), 0)
    own.set_state(np.zeros(4), np.zeros(4))
    matrix = own.mass_matrix()
    link_1, link_2 = (0.35**2 + 0.1**2) / 12.0, (0.42**2 + 0.1**2) / 12.0
    about_base = 0.5 * 6.0 * 0.25**2 + link_1 + 0.175**2 + link_2 + 0.56**2
    assert matrix[:2, :2] == pytest.approx(8.0 * np.eye(2))
    assert matrix[1, 2] == pytest.approx(0.175 + 0.56)
    assert matrix[2, 2] == pytest.approx(about_base, rel=1e-4)
    assert matrix[3, 3] == pytest.approx(link_2 + 0.21**2, rel=1e-4)


def test_bias_holds_the_damping_of_the_joints(tmp_path):
    damped = "<dynamics><damping>0.7</damping></dynamics><limit><lower>-1</lower><upper>1</upper></limit>"
    scenario = load_scenario(write_with_robot(tmp_path, Arm(joints=(("revolute", "0 0 1", damped),)).text()))
    own = robot_dynamics(scenario, 0)
    own.set_state(np.array([0.0, 0.0, 0.0, 0.3]), np.array([0.0, 0.0, 0.0, 2.0]))
    undamped = robot_dynamics(
        load_scenario(
            write_with_robot(
                tmp_path,
                Arm(
                    joints=(("revolute", "0 0 1", "<limit><lower>-1</lower><upper>1</upper></limit>"),)
                ).text(),
            )
        ),
        0,
    )
    undamped.set_state(np.array([0.0, 0.0, 0.0, 0.3]), np.array([0.0, 0.0, 0.0, 2.0]))
    assert own.bias() - undamped.bias() == pytest.approx([0.0, 0.0, 0.0, 1.4])
