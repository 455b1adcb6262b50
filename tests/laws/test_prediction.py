"""The predictor as a law: against the closed-form arm, whose accelerations are those commanded."""

import numpy as np
import pytest

from coop_drake.laws.measurements import predict, wanted_accelerations
from coop_drake.laws.robot_dynamics import (
    base_acceleration,
    end_effector_command,
    estimate_object,
    motion_room,
    robot_effort,
)
from tests.support.planar_arm import random_arm, random_state
from tests.support.robot_matrices import robot_acceleration


@pytest.mark.parametrize("joints", [0, 1, 3])
def test_the_base_accelerates_as_the_equations_say(joints):
    rng = np.random.default_rng(joints)
    arm = random_arm(rng, joints)
    z, v = random_state(rng, joints)
    _, jacobian, rate_term = arm.end_effector(z, v)
    command, axes, effort = rng.normal(size=6), rng.normal(size=1 + joints), np.empty(3 + joints)
    robot = np.concatenate([z, v])
    found = base_acceleration(arm.chain(), motion_room(arm.chain()), robot, command, axes)
    expected = robot_acceleration(command[:3], axes[1:], jacobian=jacobian, jacobian_rate_term=rate_term)
    np.testing.assert_allclose(found, expected[:3], atol=1e-10)
    robot_effort(arm.chain(), motion_room(arm.chain()), robot, command, axes, effort)
    mass_matrix, bias = arm.dynamics(z, v)
    moved = np.linalg.solve(mass_matrix, effort - bias - jacobian.T @ command[3:])
    np.testing.assert_allclose(moved[:3], found, atol=1e-9)


@pytest.mark.parametrize("joints", [0, 2])
def test_constant_accelerations_are_predicted_exactly(joints):
    rng = np.random.default_rng(20 + joints)
    arm, (z, v) = random_arm(rng, joints), random_state(rng, joints)
    robot, pose, grasp = np.concatenate([z, v]), rng.normal(size=3), rng.normal(size=2)
    rows = np.tile(rng.normal(size=6 + joints), (5, 1))
    predicted, predicted_pose, state, period = np.empty(robot.size), np.empty(3), np.empty(6), 0.02
    predict(arm.chain(), grasp, robot, pose, rows, period, predicted, predicted_pose)
    estimate_object(arm.chain(), grasp, motion_room(arm.chain()), robot, pose, state)
    time, n = 5 * period, 3 + joints
    for found, x, rate, a in (
        (predicted[:n], z, v, rows[0, 3:]),
        (predicted_pose, pose, state[3:], rows[0, :3]),
    ):
        np.testing.assert_allclose(found, x + time * rate + 0.5 * time**2 * a, atol=1e-12)
    np.testing.assert_allclose(predicted[n:], v + time * rows[0, 3:], atol=1e-12)


def test_what_is_kept_is_what_was_commanded():
    rng = np.random.default_rng(5)
    arm, (z, v) = random_arm(rng, 2), random_state(rng, 2)
    robot, pose, load = np.concatenate([z, v]), rng.normal(size=3), rng.uniform(0.1, 1.0, size=7)
    linear, axes, kept = rng.normal(size=2), rng.normal(size=3), np.empty(8)
    wanted_accelerations(arm.chain(), load, robot, pose, linear, axes, kept)
    state, command = np.empty(6), np.empty(6)
    estimate_object(arm.chain(), load[:2], motion_room(arm.chain()), robot, pose, state)
    end_effector_command(load, state, linear, axes, command)
    np.testing.assert_array_equal(kept[:3], [*linear, axes[0]])
    np.testing.assert_array_equal(
        kept[3:6], base_acceleration(arm.chain(), motion_room(arm.chain()), robot, command, axes)
    )
    np.testing.assert_array_equal(kept[6:], axes[1:])
