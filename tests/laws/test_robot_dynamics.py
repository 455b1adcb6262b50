"""A robot's effort moves the grasp as commanded; the team's efforts move the object and share its load."""

import numpy as np
import pytest

from coop_drake.laws import acceleration_at, total_wrench, wrench_share
from coop_drake.laws.robot_dynamics import (
    end_effector_command,
    motion_room,
    robot_effort,
)
from tests.support.planar_arm import random_arm, random_state
from tests.support.robot_matrices import grasp_matrix, robot_acceleration, turned


@pytest.mark.parametrize("joints", [0, 1, 2, 4])
def test_the_closed_form_of_the_arm_satisfies_the_equations_of_motion(joints):
    """Check the tests' own model: M' - 2 C is skew, so bias forces do the work that changes M."""
    rng = np.random.default_rng(joints)
    arm = random_arm(rng, joints)
    z, v = random_state(rng, joints)
    _, bias = arm.dynamics(z, v)
    h = 1e-5
    mass_rate = (arm.dynamics(z + h * v, v)[0] - arm.dynamics(z - h * v, v)[0]) / (2.0 * h)
    assert v @ bias == pytest.approx(0.5 * v @ mass_rate @ v, rel=1e-6, abs=1e-8)
    _, jacobian, rate_term = arm.end_effector(z, v)
    ahead, behind = arm.end_effector(z + h * v, v)[1], arm.end_effector(z - h * v, v)[1]
    assert rate_term == pytest.approx((ahead - behind) @ v / (2.0 * h), abs=1e-7)
    assert jacobian.shape == (3, 3 + joints)


@pytest.mark.parametrize("joints", [(1, 1), (2, 1, 3), (1, 0, 2, 1, 2)])
def test_the_team_moves_the_object_as_commanded_and_loads_every_grasp_by_its_share(joints):
    """Solve the team's constrained dynamics, (2) and (27), and find what every robot meant to happen."""
    rng = np.random.default_rng(sum(joints))
    mass, inertia, com_offset = 1.7, 0.6, np.array([0.05, -0.12])
    wanted, rate = rng.normal(size=3), 1.3
    robots, columns = len(joints), 3
    sizes = [3 + n for n in joints]
    unknowns = 3 + sum(sizes) + 3 * robots
    system, right = np.zeros((unknowns, unknowns)), np.zeros(unknowns)
    # Object: M a_com = sum of the wrenches, torques about the centre of mass.
    body = np.diag([mass, mass, inertia])
    system[:3, :3] = body @ grasp_matrix(com_offset)
    right[:3] = body @ np.array([*(rate**2 * com_offset), 0.0])
    row, wrench_at = 3, 3 + sum(sizes)
    shares = rng.dirichlet(np.ones(robots))
    commanded = []
    for k, n in enumerate(joints):
        arm = random_arm(rng, n)
        z, v = random_state(rng, n)
        offset = rng.uniform(-0.5, 0.5, 2)
        # The grasp is rigid, so the base moves such that J z' is the twist of the grasp.
        _, jacobian, _ = arm.end_effector(z, v)
        twist = grasp_matrix(offset) @ np.array([0.3, -0.2, rate])
        v[:3] = np.linalg.solve(jacobian[:, :3], twist - jacobian[:, 3:] @ v[3:])
        _, jacobian, rate_term = arm.end_effector(z, v)
        mass_matrix, bias = arm.dynamics(z, v)
        joint_wanted = rng.normal(size=n)
        load = np.array([*offset, *com_offset, mass, inertia, shares[k]])
        command, torque, axes = np.empty(6), np.empty(3 + n), np.array([wanted[2], *joint_wanted])
        end_effector_command(load, np.array([0.0, 0.0, 0.0, 0.0, 0.0, rate]), wanted[:2], axes, command)
        robot_effort(arm.chain(), motion_room(arm.chain()), np.concatenate([z, v]), command, axes, torque)
        z_wanted = robot_acceleration(
            command[:3], joint_wanted, jacobian=jacobian, jacobian_rate_term=rate_term
        )
        commanded.append((z_wanted, command[3:]))
        z_slice, w_slice = slice(columns, columns + 3 + n), slice(wrench_at + 3 * k, wrench_at + 3 * k + 3)
        system[:3, w_slice] = -grasp_matrix(offset - com_offset).T
        system[row : row + 3 + n, z_slice] = mass_matrix
        system[row : row + 3 + n, w_slice] = jacobian.T
        right[row : row + 3 + n] = torque - bias
        row += 3 + n
        system[row : row + 3, z_slice] = jacobian
        system[row : row + 3, :3] = -grasp_matrix(offset)
        right[row : row + 3] = np.array([*(-(rate**2) * offset), 0.0]) - rate_term
        row += 3
        columns += 3 + n
    solution = np.linalg.solve(system, right)
    assert solution[:3] == pytest.approx(wanted, abs=1e-9)
    expected = np.concatenate([z for z, _ in commanded] + [share for _, share in commanded])
    assert solution[3:] == pytest.approx(expected, abs=1e-9)


OFFSET = np.array([0.4, -0.1])


def test_acceleration_at_a_point_is_the_second_derivative_of_its_path():
    acceleration, velocity, rate, alpha = np.array([0.5, -1.0]), np.array([0.2, 0.1]), 0.9, -2.0

    def path(t):
        return velocity * t + 0.5 * acceleration * t**2 + turned(rate * t + 0.5 * alpha * t**2, OFFSET)

    h = 1e-4
    numeric = (path(h) - 2.0 * path(0.0) + path(-h)) / h**2
    assert acceleration_at(*OFFSET, *acceleration, alpha, rate) == pytest.approx(numeric, abs=1e-6)


def test_an_object_spinning_about_its_origin_needs_a_force_when_its_mass_is_elsewhere():
    com_offset = np.array([0.1, 0.0])
    of_com = acceleration_at(*com_offset, 0.0, 0.0, 0.0, 2.0)
    assert wrench_share(*com_offset, *of_com, 0.0, 3.0, 1.0, 0.5) == pytest.approx([-0.6, 0.0, 0.0])


def test_a_force_beside_the_centre_of_mass_turns_the_object():
    wrench = total_wrench(np.array([[0.0, 2.0, 0.5]]), np.array([[0.5, 0.0]]), np.array([0.1, 0.0]), 0.0)
    assert wrench == pytest.approx([0.0, 2.0, 1.3])


def test_a_wrench_turns_with_the_object():
    generator = np.random.default_rng(2)
    wrenches, grasps, p_LLcm = generator.normal(size=(4, 3)), generator.normal(size=(4, 2)), OFFSET
    forces = np.array([turned(0.7, force) for force in wrenches[:, :2]])
    expected = total_wrench(wrenches, grasps, p_LLcm, 0.0)
    found = total_wrench(np.hstack([forces, wrenches[:, 2:]]), grasps, p_LLcm, 0.7)
    assert found == pytest.approx([*turned(0.7, expected[:2]), expected[2]])


def test_end_effectors_of_a_team_do_what_moves_the_object():
    """The commands of a whole team: rigid motion of every grasp, and the wrench that the object needs."""
    generator, p_LLcm, mass, inertia = np.random.default_rng(3), np.array([0.05, -0.12]), 1.7, 0.6
    grasps, shares = generator.normal(size=(3, 2)), np.array([0.5, 0.2, 0.3])
    state, linear, alpha = generator.normal(size=6), generator.normal(size=2), 0.8
    commands = np.empty((3, 6))
    for grasp, share, command in zip(grasps, shares, commands, strict=True):
        load = np.array([*grasp, *p_LLcm, mass, inertia, share])
        end_effector_command(load, state, linear, np.array([alpha, 9.0]), command)
        centripetal = np.array([*(-(state[5] ** 2) * turned(state[2], grasp)), 0.0])
        expected = grasp_matrix(turned(state[2], grasp)) @ [*linear, alpha] + centripetal
        assert command[:3] == pytest.approx(expected)
    of_com = acceleration_at(*turned(state[2], p_LLcm), *linear, alpha, state[5])
    needed = [mass * of_com[0], mass * of_com[1], inertia * alpha]
    wrenches = np.ascontiguousarray(commands[:, 3:])
    assert total_wrench(wrenches, grasps, p_LLcm, state[2]) == pytest.approx(needed)
    assert wrenches[:, :2] == pytest.approx(np.outer(shares, needed[:2]))
