"""The nominal motion of the object and of the axes stays where it may, and is carried exactly."""

from math import hypot

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.systems.framework import DiagramBuilder
from scipy.integrate import solve_ivp
from shapely import box

from coop_drake.geometry.polygons import edges_of
from coop_drake.laws import nominal
from coop_drake.laws.governor import governed_acceleration
from coop_drake.laws.robot_dynamics import motion_room, read_robot
from coop_drake.plant import base_chain, build_team_plant
from coop_drake.scenario import load_scenario
from coop_drake.systems.kernels import nominal_margins, show_nominal

coordinates = st.floats(-1.0, 1.0)


gains = st.sampled_from([(50.0, 9.9), (150.0, 17.1), (100.0, 20.0), (100.0, 45.0)])


@pytest.mark.parametrize("damping", [5.0, 20.0, 60.0])
def test_the_flow_solves_the_equation_of_motion(damping):
    stiffness, period, steps = 100.0, 0.01, 4000
    state, h = np.array([0.3, -0.7]), period / steps
    flow = nominal.nominal_flow(stiffness, damping, period) @ state
    for _ in range(steps):  # midpoint rule
        middle = state + 0.5 * h * np.array(
            [state[1], governed_acceleration(*state, 0.0, stiffness, damping)]
        )
        state = state + h * np.array([middle[1], governed_acceleration(*middle, 0.0, stiffness, damping)])
    np.testing.assert_allclose(flow, state, rtol=1e-8)


@settings(max_examples=60)
@given(gains, coordinates, coordinates, coordinates, coordinates)
def test_the_excursion_never_grows_while_the_reference_rests(gains, x, y, vx, vy):
    stiffness, damping = gains
    edges, target = edges_of(box(-9.0, -9.0, 9.0, 9.0)), np.zeros(2)

    def excursion():
        return 9.0 - nominal_margins(edges, stiffness, np.array([x, y, vx, vy]), target)[1]

    flow, before = nominal.nominal_flow(stiffness, damping, 0.005), excursion()
    first = before
    for _ in range(200):
        (x, vx), (y, vy) = flow @ (x, vx), flow @ (y, vy)
        after = excursion()
        assert after <= before * (1.0 + 1e-12) + 1e-15
        assert hypot(x, y) <= first * (1.0 + 1e-9) + 1e-15
        before = after


def test_no_way_is_longer_than_the_reach():
    """p_G that always flees from its target as quickly as the field could move it."""
    edges, shown = edges_of(box(-9.0, -9.0, 9.0, 9.0)), np.empty(6)
    for distance, speed in ((0.001, 1.0), (0.05, 1.0), (0.5, 0.3)):
        state = np.array([0.0, 0.0, 0.0, 0.0, distance, 0.0])
        way, off = 0.0, distance
        for periods in range(1, 9):
            step = min(0.005 * speed, 0.005 * 30.0 * off)
            way, off = way + step, off + step
            show_nominal(edges, 100.0, np.zeros(2), 0.005, float(periods), speed, state, shown)
            assert way <= shown[5] * (1.0 + 1e-12)


def test_on_the_nominal_motion_the_object_accelerates_as_it_does():
    own = (
        governed_acceleration(0.1, 0.2, 0.15, 100.0, 14.0),
        governed_acceleration(0.3, -0.1, 0.2, 100.0, 14.0),
    )
    gains, governor, same = np.array([100.0, 14.0, 250.0, 30.0]), np.array([0.15, 0.2]), np.empty(2)
    led, state, off = np.array([0.1, 0.3, 0.2, -0.1]), np.array([0.1, 0.3, 7.0, 0.2, -0.1, 7.0]), np.empty(2)
    nominal.track_nominal(gains, state, governor, led, led, same)
    assert tuple(same) == own
    nominal.track_nominal(gains, state + 0.01 * np.array([1, 0, 0, 0, 10, 0]), governor, led, led, off)
    np.testing.assert_allclose(off - same, [-2.5, -3.0])


@pytest.mark.parametrize("lag", [0.0, 0.003])
def test_a_period_is_carried_as_the_differential_equation_says(lag):
    state, command, following = np.array([[0.2], [-0.7], [3.0]]), np.array([5.0]), np.empty((3, 1))
    nominal.carry_axes(state, command, 0.01, lag, following)
    if lag == 0.0:
        expected = [0.2 - 0.7 * 0.01 + 0.5 * 5.0 * 1e-4, -0.7 + 0.05, 5.0]
    else:
        motion = solve_ivp(
            lambda _, y: [y[1], y[2], (5.0 - y[2]) / lag], (0.0, 0.01), state[:, 0], rtol=1e-11, atol=1e-13
        )
        expected = motion.y[:, -1]
    np.testing.assert_allclose(following[:, 0], expected, rtol=1e-8)


def test_the_pull_is_that_of_a_spring_and_a_damper():
    law, expected, pulled = np.array([1.5, 2.5]), np.array([[0.3, 0.6], [-0.2, 0.4]]), np.empty(2)
    state, robot = (
        np.array([7.0, 7.0, 0.3, 7.0, 7.0, -0.2]),
        np.array([7.0, 7.0, 7.0, 0.6, 7.0, 7.0, 7.0, 0.4]),
    )
    nominal.pull_axes(law, state, robot, expected, (400.0, 30.0), pulled)
    assert pulled.tolist() == [1.5, 2.5]
    state[[2, 5]], robot[[3, 7]] = [0.31, -0.1], [0.61, 0.4]
    nominal.pull_axes(law, state, robot, expected, (400.0, 30.0), pulled)
    assert pulled == pytest.approx([1.5 - 4.0 - 3.0, 2.5 - 4.0])


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
        nominal.place_on_axes(own, base.mounting, found)
        found[2] = np.angle(np.exp(1j * found[2]))
        np.testing.assert_allclose(found[[2, 3, 4, 7, 8, 9]], expected[[2, 3, 4, 7, 8, 9]], atol=1e-12)
        np.testing.assert_array_equal(found[[0, 1, 5, 6]], [*away, *away])
