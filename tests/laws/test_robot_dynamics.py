import numpy as np
import pytest

from coop_drake.laws.robot_dynamics import end_effector_command, estimate_object, motion_room, robot_effort
from tests.support.planar_arm import random_arm, random_state
from tests.support.robot_matrices import consistent_projector, grasp_matrix, robot_acceleration


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


@pytest.mark.parametrize("joints", [0, 1, 2, 4])
def test_end_effector_and_joints_accelerate_as_asked(joints):
    """Solve the equations of motion (2) with the effort of the law and the object's reaction."""
    rng = np.random.default_rng(10 + joints)
    arm = random_arm(rng, joints)
    z, v = random_state(rng, joints)
    _, jacobian, rate_term = arm.end_effector(z, v)
    mass_matrix, bias = arm.dynamics(z, v)
    command, axes, effort = rng.normal(size=6), rng.normal(size=1 + joints), np.empty(3 + joints)
    robot, chain, seen = np.concatenate([z, v]), arm.chain(), np.empty(6)
    robot_effort(chain, motion_room(chain), robot, command, axes, effort)
    acceleration = np.linalg.solve(mass_matrix, effort - bias - jacobian.T @ command[3:])
    assert jacobian @ acceleration + rate_term == pytest.approx(command[:3], abs=1e-10)
    assert acceleration[3:] == pytest.approx(axes[1:], abs=1e-10)
    estimate_object(chain, np.zeros(2), motion_room(chain), robot, np.zeros(3), seen)
    assert seen[3:] == pytest.approx(jacobian @ v)


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


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_projected_forces_leave_the_end_effector_alone(joints):
    rng = np.random.default_rng(joints)
    arm = random_arm(rng, joints)
    z, v = random_state(rng, joints)
    _, jacobian, _ = arm.end_effector(z, v)
    mass_matrix, _ = arm.dynamics(z, v)
    projector = consistent_projector(mass_matrix, jacobian)
    assert projector @ projector == pytest.approx(projector, abs=1e-10)
    assert jacobian @ np.linalg.solve(mass_matrix, projector) == pytest.approx(
        np.zeros((3, 3 + joints)), abs=1e-10
    )
    assert np.linalg.matrix_rank(projector, tol=1e-8) == joints
