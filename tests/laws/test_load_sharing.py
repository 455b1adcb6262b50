import numpy as np
import pytest

from coop_drake.laws import acceleration_at, object_twist, total_wrench, wrench_share
from coop_drake.laws.robot_dynamics import end_effector_command, rotated
from tests.support.robot_matrices import grasp_matrix, turned

OFFSET = np.array([0.4, -0.1])


def test_rotation_is_counter_clockwise():
    assert rotated(0.0, 1.0, 2.0, 1.0) == (-1.0, 2.0)


def test_a_grasp_ahead_of_a_turning_object_moves_to_the_left():
    assert (grasp_matrix(np.array([0.4, 0.0])) @ np.array([0.0, 0.0, 1.0])).tolist() == [0.0, 0.4, 1.0]


def test_the_object_twist_undoes_the_grasp_matrix():
    twist = np.array([0.3, -0.2, 0.7])
    assert object_twist(*OFFSET, *(grasp_matrix(OFFSET) @ twist)) == pytest.approx(twist)


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
