"""The nominal motion of an axis: carried over a period exactly, and its pull."""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder
from scipy.integrate import solve_ivp

from coop_drake.laws.nominal import carry_axes, place_on_axes, pulled_axis
from coop_drake.laws.robot_dynamics import motion_room, read_robot
from coop_drake.plant import base_chain, build_team_plant
from coop_drake.scenario import load_scenario


@pytest.mark.parametrize("lag", [0.0, 0.003])
def test_a_period_is_carried_as_the_differential_equation_says(lag):
    state, command, following = np.array([[0.2], [-0.7], [3.0]]), np.array([5.0]), np.empty((3, 1))
    carry_axes(state, command, 0.01, lag, following)
    if lag == 0.0:
        expected = [0.2 - 0.7 * 0.01 + 0.5 * 5.0 * 1e-4, -0.7 + 0.05, 5.0]
    else:
        motion = solve_ivp(
            lambda _, y: [y[1], y[2], (5.0 - y[2]) / lag], (0.0, 0.01), state[:, 0], rtol=1e-11, atol=1e-13
        )
        expected = motion.y[:, -1]
    np.testing.assert_allclose(following[:, 0], expected, rtol=1e-8)


def test_an_axis_on_its_nominal_motion_is_not_pulled():
    assert pulled_axis(1.5, 0.3, -0.2, (0.3, -0.2), (400.0, 30.0)) == 1.5


def test_the_pull_is_that_of_a_spring_and_a_damper():
    assert pulled_axis(1.5, 0.31, -0.1, (0.3, -0.2), (400.0, 30.0)) == pytest.approx(1.5 - 4.0 - 3.0)


def test_the_base_of_every_robot_turns_with_the_object_and_against_its_joints():
    team = build_team_plant(load_scenario("elbow"), DiagramBuilder())
    n, generator = team.plant.num_positions(), np.random.default_rng(0)
    state, away = generator.uniform(-1.0, 1.0, 2 * n), np.array([7.0, 8.0])
    axes = np.array([state[team.position_index[2:]], state[n + team.velocity_index[2:]]])
    for robot in team.robots:
        base, expected, found = base_chain(team, robot), np.empty(10), np.empty(10)
        read_robot(base.chain, base.yaw, base.joints, motion_room(base.chain), state, expected)
        own = np.ascontiguousarray(axes[:, [0, *range(1 + robot.q_slice.start, 1 + robot.q_slice.stop)]])
        found[[0, 1]], found[[5, 6]] = away, away
        place_on_axes(own, base.mounting, found)
        found[2] = np.angle(np.exp(1j * found[2]))
        np.testing.assert_allclose(found[[2, 3, 4, 7, 8, 9]], expected[[2, 3, 4, 7, 8, 9]], atol=1e-12)
        np.testing.assert_array_equal(found[[0, 1, 5, 6]], [*away, *away])
