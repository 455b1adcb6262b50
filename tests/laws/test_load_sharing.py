import numpy as np
import pytest

from coop_drake.laws import acceleration_at, grasp_matrix, object_twist, rotate, total_wrench, wrench_share

OFFSET = np.array([0.4, -0.1])


def test_rotate_is_counter_clockwise():
    assert rotate(np.pi / 2, np.array([2.0, 1.0])) == pytest.approx([-1.0, 2.0])


def test_a_grasp_ahead_of_a_turning_object_moves_to_the_left():
    assert (grasp_matrix(np.array([0.4, 0.0])) @ np.array([0.0, 0.0, 1.0])).tolist() == [0.0, 0.4, 1.0]


def test_the_object_twist_undoes_the_grasp_matrix():
    twist = np.array([0.3, -0.2, 0.7])
    assert object_twist(OFFSET, grasp_matrix(OFFSET) @ twist) == pytest.approx(twist)


def test_acceleration_at_a_point_is_the_second_derivative_of_its_path():
    acceleration, velocity, rate, alpha = np.array([0.5, -1.0]), np.array([0.2, 0.1]), 0.9, -2.0

    def path(t):
        return velocity * t + 0.5 * acceleration * t**2 + rotate(rate * t + 0.5 * alpha * t**2, OFFSET)

    h = 1e-4
    numeric = (path(h) - 2.0 * path(0.0) + path(-h)) / h**2
    exact = acceleration_at(np.array([*acceleration, alpha]), rate, OFFSET)
    assert exact[:2] == pytest.approx(numeric, abs=1e-6)
    assert exact[2] == alpha


def test_an_object_spinning_about_its_origin_needs_a_force_when_its_mass_is_elsewhere():
    share = wrench_share(
        np.zeros(3), 2.0, np.zeros(2), com_offset=np.array([0.1, 0.0]), mass=3.0, inertia=1.0, share=0.5
    )
    assert share == pytest.approx([-0.6, 0.0, 0.0])


def test_a_force_beside_the_centre_of_mass_turns_the_object():
    wrench = total_wrench(
        np.array([[0.0, 2.0, 0.5]]), np.array([[0.5, 0.0]]), com_offset=np.array([0.1, 0.0])
    )
    assert wrench == pytest.approx([0.0, 2.0, 1.3])
