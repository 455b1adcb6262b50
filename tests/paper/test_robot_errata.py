"""E23, E25 and E33: what a robot's own dynamics need, on closed-form planar arms."""

import numpy as np
import pytest

from coop_drake.laws.robot_dynamics import motion_room, robot_effort
from paper import printed
from tests.support.planar_arm import random_arm, random_state
from tests.support.robot_matrices import consistent_projector, robot_acceleration

JOINTS = [1, 2, 3]


def moving_arms(joints, count=40):
    rng = np.random.default_rng(joints)
    for _ in range(count):
        arm = random_arm(rng, joints)
        z, v = random_state(rng, joints)
        _, jacobian, rate_term = arm.end_effector(z, v)
        yield rng, arm, z, v, jacobian, rate_term


@pytest.mark.parametrize("joints", JOINTS)
def test_e23_forces_through_the_printed_projector_disturb_the_grasp(joints):
    """Only the projector weighted by the inertia leaves the end effector's acceleration alone."""
    disturbed, left_alone = [], []
    for rng, arm, z, v, jacobian, _ in moving_arms(joints):
        mass_matrix, _ = arm.dynamics(z, v)
        force = rng.normal(size=z.size) * 10.0
        through = (printed.projector(jacobian), consistent_projector(mass_matrix, jacobian))
        for projector, errors in zip(through, (disturbed, left_alone), strict=True):
            errors.append(np.linalg.norm(jacobian @ np.linalg.solve(mass_matrix, projector @ force)))
    assert np.median(disturbed) > 0.5
    assert max(left_alone) < 1e-9


@pytest.mark.parametrize("joints", JOINTS)
def test_e25_the_end_effector_twist_does_not_tell_how_the_jacobian_changes(joints):
    """J^+ x' is z' less its motion in the null space, on which J' acts too."""
    printed_errors, corrected_errors = [], []
    for _, arm, z, v, jacobian, rate_term in moving_arms(joints):
        h = 1e-5
        before, now, after = (arm.end_effector(z + t * v, v) for t in (-h, 0.0, h))
        # With z'' = 0 the grasp's acceleration, from its path alone, is what J' contributes.
        truth = (after[1] @ v - before[1] @ v)[:2] / (2.0 * h)
        assert truth == pytest.approx((after[0] - 2.0 * now[0] + before[0]) / h**2, abs=1e-3)
        jacobian_rate = (after[1] - before[1]) / (2.0 * h)
        as_printed = printed.rate_term(jacobian_rate, jacobian, jacobian @ v)
        printed_errors.append(np.linalg.norm(as_printed[:2] - truth))
        corrected_errors.append(np.linalg.norm(rate_term[:2] - truth))
    assert max(printed_errors) > 0.1
    assert np.median(printed_errors) > 1e4 * max(corrected_errors)


@pytest.mark.parametrize("joints", JOINTS)
def test_e33_task_space_forces_reach_the_actuators_through_the_transpose(joints):
    """J cannot multiply a wrench unless the robot has no joints; J^T makes the wrench appear at the grasp."""
    for rng, arm, z, v, jacobian, rate_term in moving_arms(joints, count=5):
        wrench = rng.normal(size=3)
        with pytest.raises(ValueError, match="mismatch"):
            jacobian @ wrench
        mass_matrix, bias = arm.dynamics(z, v)
        at_grasp, axes, torque = rng.normal(size=3), rng.normal(size=1 + joints), np.empty(3 + joints)
        wanted = robot_acceleration(at_grasp, axes[1:], jacobian=jacobian, jacobian_rate_term=rate_term)
        command = np.concatenate([at_grasp, wrench])
        robot_effort(arm.chain(), motion_room(arm.chain()), np.concatenate([z, v]), command, axes, torque)
        # (2) solved for the acceleration, with the object pushing back.
        got = np.linalg.solve(mass_matrix, torque - bias - jacobian.T @ wrench)
        assert got == pytest.approx(wanted, abs=1e-9)
