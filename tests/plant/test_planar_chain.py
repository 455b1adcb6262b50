"""The compiled chains against Drake's own models of the same robots."""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.laws.robot_dynamics import estimate_object, motion_room, read_robot, robot_effort
from coop_drake.plant import base_chain, build_team_plant, robot_chain
from coop_drake.systems import RobotEffort
from tests.support.ring_team import PRISMATIC, REVOLUTE, ring_team
from tests.support.robot_dynamics import robot_dynamics
from tests.support.robot_matrices import robot_acceleration
from tests.support.system_checks import evaluate

ARMS = [[REVOLUTE, PRISMATIC, REVOLUTE], [PRISMATIC], [REVOLUTE, REVOLUTE]]


@pytest.fixture(scope="module")
def scenario(tmp_path_factory):
    return ring_team(tmp_path_factory.mktemp("ring"), ARMS)


@pytest.mark.parametrize("k", range(len(ARMS)))
def test_an_end_effector_moves_and_is_moved_as_in_drake(scenario, k):
    robot, n = robot_dynamics(scenario, k), len(ARMS[k])
    robot.scale_masses(1.3)
    for joint in robot.joints:
        joint.SetDampingVector(robot.context, [0.7])
    robot.plant.get_joint_actuator(robot.plant.GetJointActuatorIndices()[0]).SetRotorInertia(
        robot.context, 0.4
    )
    chain, generator = robot_chain(robot), np.random.default_rng(k)
    for state, hand, joints in zip(
        generator.normal(size=(20, 2 * (3 + n))),
        generator.normal(size=(20, 6)),
        generator.normal(size=(20, n)),
        strict=True,
    ):
        robot.set_state(*np.split(state, 2))
        jacobian = robot.grasp_jacobian()
        seen, motion = np.empty(6), motion_room(chain)
        estimate_object(chain, np.zeros(2), motion, state, np.zeros(3), seen)
        np.testing.assert_allclose(seen[3:], jacobian @ state[3 + n :], atol=1e-14)
        acceleration = robot_acceleration(
            hand[:3], joints, jacobian=jacobian, jacobian_rate_term=robot.grasp_bias()
        )
        expected = robot.inertial_effort(acceleration) + hand[3:] @ jacobian
        effort = np.empty(3 + n)
        robot_effort(chain, motion, state, hand, np.array([9.0, *joints]), effort)
        np.testing.assert_allclose(effort, expected, atol=1e-13 * np.abs(expected).max())


def test_a_base_is_where_the_teams_plant_has_it(scenario):
    team = build_team_plant(scenario, DiagramBuilder())
    context, generator = team.plant.CreateDefaultContext(), np.random.default_rng(1)
    for robot in team.robots:
        way, n = base_chain(team, robot), len(robot.joints)
        for state in generator.normal(size=(20, team.plant.num_multibody_states())):
            team.plant.SetPositionsAndVelocities(context, state)
            X_WB = robot.base_body.EvalPoseInWorld(context).GetAsMatrix34()
            V_WB = robot.base_body.EvalSpatialVelocityInWorld(context).get_coeffs()
            found = np.empty(2 * (3 + n))
            read_robot(way.chain, way.yaw, way.joints, motion_room(way.chain), state, found)
            expected = [X_WB[0, 3], X_WB[1, 3], np.arctan2(X_WB[1, 0], X_WB[0, 0])]
            np.testing.assert_allclose(found[:3], expected, atol=1e-14)
            np.testing.assert_allclose(found[3 + n : 6 + n], V_WB[[3, 4, 2]], atol=1e-14)


def test_springs_of_a_model_are_held(tmp_path):
    dynamics = (
        "<damping>0.3</damping><spring_stiffness>2</spring_stiffness><spring_reference>0.4</spring_reference>"
    )
    more = f"<limit><lower>-1</lower><upper>1</upper></limit><dynamics>{dynamics}</dynamics>"
    robot = robot_dynamics(ring_team(tmp_path, [[("revolute", "0 0 1", more)], [REVOLUTE]]), 0)
    assert robot.has_springs
    state, hand, joints = np.linspace(0.1, 0.8, 8), np.linspace(-1.0, 1.0, 6), np.array([0.5])
    inputs = {"robot_state": state, "hand_command": hand, "axis_acceleration": [9.0, *joints]}
    effort = evaluate(RobotEffort(robot), inputs, "robot_effort")
    robot.set_state(*np.split(state, 2))
    jacobian = robot.grasp_jacobian()
    z = robot_acceleration(hand[:3], joints, jacobian=jacobian, jacobian_rate_term=robot.grasp_bias())
    expected = robot.inertial_effort(z) + hand[3:] @ jacobian
    np.testing.assert_allclose(effort, expected, atol=1e-13)
    without = np.empty(4)
    chain = robot_chain(robot)
    robot_effort(chain, motion_room(chain), state, hand, np.array([9.0, *joints]), without)
    assert effort[3] - without[3] == pytest.approx(2.0 * (state[3] - 0.4))
