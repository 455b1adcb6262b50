"""How the object, its axes, actuators and robots move: exact solutions, limits, and the same by matrices."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.systems.framework import DiagramBuilder

from coop_drake.diagram import brakes_of
from coop_drake.laws import acceleration_at, actuators, total_wrench
from coop_drake.laws.axis_table import DECAY_RATE, FADING_TIME, LAW_COLUMNS, RAMP_RATE, bounds_of
from coop_drake.laws.motion import place_on_axes
from coop_drake.laws.robot_dynamics import (
    end_effector_command,
    motion_room,
    read_robot,
)
from coop_drake.plant import base_chain, build_team_plant
from coop_drake.plant.team import base_inertia
from coop_drake.scenario import ActuatorLimits, load_scenario
from tests.support.robot_matrices import grasp_matrix, turned
from tests.support.small_scenario import small_scenario


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


# Brakes of the drives, and the slow way on which a cell is begun anew.


@pytest.mark.parametrize("distance", [1e-4, 0.05, 0.4, 3.0])
def test_the_way_keeps_to_its_bounds_and_ends_at_rest(distance):
    T = 0.005
    samples = actuators.slow_samples(distance, T)
    ends = np.array([[1.0, 0.2], [1.0 - distance, 0.2]])
    motions = [actuators.slow_motion(ends, k * T, samples * T) for k in range(samples + 1)]
    x, v, a = (np.array(part) for part in zip(*motions, strict=True))
    assert (x[0], x[-1]) == (pytest.approx(ends[0]), pytest.approx(ends[1]))
    assert np.abs([v[0], v[-1], a[0], a[-1]]).max() < 1e-12
    assert np.abs(v).max() <= actuators.USED * actuators.RATE
    assert np.abs(a).max() <= actuators.USED * actuators.ACCELERATION
    assert np.gradient(x[:, 0], T)[1:-1] == pytest.approx(
        v[1:-1, 0], abs=2e-3 * actuators.USED * actuators.RATE
    )
    assert (x[:, 1] == 0.2).all()


def test_before_and_after_it_nothing_moves():
    for time in (-1.0, 7.0):
        x, v, a = actuators.slow_motion(np.array([[0.0], [1.0]]), time, 3.0)
        assert (x[0], v[0], a[0]) == (float(time > 0.0), 0.0, 0.0)


def test_funnels_are_closed_gains_ramped_and_jumps_faded_when_the_law_takes_over():
    table = np.ones((2, LAW_COLUMNS))
    table[:, :4] = [-0.3, 0.3, -0.05, 0.05]
    table[:, DECAY_RATE], table[:, RAMP_RATE], table[:, FADING_TIME] = [10.0, 5.0], [2.0, 0.0], 0.4
    time = actuators.closed_after(table)
    assert time == pytest.approx(3.0)
    for row in table:
        assert bounds_of(row, time)[:4] == pytest.approx((-0.05, 0.05, 0.0, 0.0))


def test_efforts_follow_those_that_are_held_as_a_low_pass():
    held, before, given = np.array([3.0, -1.0]), np.array([0.0, 2.0]), np.empty(2)
    for time in (0.0, 0.005, 0.1):
        actuators.lag_behind(0.03, time, held, before, given)
        np.testing.assert_allclose(given, held + (before - held) * np.exp(-time / 0.03), rtol=1e-14)


FREE = np.full(3, np.inf)


def test_the_damping_follows_from_the_model_of_the_base():
    team = build_team_plant(small_scenario("base"), DiagramBuilder())
    mass, inertia = base_inertia(team.robots[0])
    assert (mass, inertia) == pytest.approx((6.0, 0.1875))
    damping = actuators.braking_damping(mass, inertia, 1)
    assert damping == pytest.approx([100.0, 100.0, 1.0, 1.0])
    assert actuators.braking_damping(2.0 * mass, 3.0 * inertia, 1) == pytest.approx([200.0, 200.0, 3.0, 1.0])


def test_drives_brake_within_the_limits_of_the_scenario_s_actuators():
    scenario = small_scenario("base")
    limited = ActuatorLimits(base_force=40.0, joint_effort=3.0)
    scenario = replace(scenario, deployment=replace(scenario.deployment, actuators=limited))
    for brake in brakes_of(scenario, build_team_plant(scenario, DiagramBuilder())):
        assert brake.limits[[0, 2]].tolist() == [40.0, 3.0]
        fast = np.concatenate([np.zeros(4), [3.0, 4.0, 0.0, 9.0]])
        assert actuators.braking_effort(fast, brake) == pytest.approx([-12.0, -16.0, 0.0, -1.5])


def test_the_power_of_braking_is_negative():
    damping = actuators.braking_damping(6.0, 0.2, 2)
    for limits in (np.full(4, np.inf), np.array([20.0, 0.1, 0.2, 3.0])):
        for seed in range(20):
            state = np.random.default_rng(seed).normal(size=10)
            assert actuators.braking_effort(state, actuators.Brake(damping, limits)) @ state[5:] < 0.0


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(-50.0, 50.0), min_size=12, max_size=12),
    st.lists(st.floats(0.1, 300.0), min_size=3, max_size=3),
)
def test_a_brake_never_asks_for_more_than_its_limits_wherever_its_rest_is(numbers, limits):
    brake = actuators.Brake(actuators.braking_damping(6.0, 0.2, 1), np.array(limits))
    effort = actuators.braking_effort(np.array(numbers[:8]), brake, np.array(numbers[8:]))
    rounded = 1.0 + 1e-12
    assert np.hypot(effort[0], effort[1]) <= rounded * limits[0]
    assert (np.abs(effort[2:]) <= rounded * brake.limits[1:]).all()


def test_drives_pull_to_the_rest_that_they_were_told_and_a_turn_of_the_yaw_is_none():
    damping, rest = actuators.braking_damping(6.0, 0.2, 1), np.array([1.0, 2.0, 3.1, 0.4])
    still = np.concatenate([rest - [0.0, 0.0, 2.0 * np.pi, 0.0], np.zeros(4)])
    assert actuators.braking_effort(still, actuators.Brake(damping, FREE), rest) == pytest.approx(
        np.zeros(4), abs=1e-12
    )
    away = np.concatenate([rest + 0.1, np.zeros(4)])
    assert actuators.braking_effort(away, actuators.Brake(damping, FREE), rest) == pytest.approx(
        -0.1 * actuators.RETURN_RATE * damping
    )


def test_two_loads_that_brake_towards_the_rest_of_a_motion_overshoot_less_than_they_would_coast():
    limits = np.array([30.0, 1.0])
    for mass, limit in ((3.0, FREE[:2]), (8.5, FREE[:2]), (20.0, FREE[:2]), (3.0, limits), (8.5, limits)):
        brake, T, farthest = actuators.Brake(actuators.braking_damping(6.0, 0.2, 0), limit), 1e-3, []
        for rest in (np.zeros(3), None):
            state, far = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), 0.0
            for _ in range(6000):
                state[3:] += T * actuators.braking_effort(state, brake, rest) / [mass, mass, 0.2]
                state[:3] += T * state[3:]
                far = max(far, state[0])
            farthest.append(far)
            assert abs(state[3]) < 1e-3
        assert farthest[0] < farthest[1]


# A robot's effort moves the grasp as commanded; the team's efforts move the object and share its load.


OFFSET = np.array([0.4, -0.1])


def test_acceleration_at_a_point_is_the_second_derivative_of_its_path():
    acceleration, velocity, rate, alpha = np.array([0.5, -1.0]), np.array([0.2, 0.1]), 0.9, -2.0

    def path(t):
        return velocity * t + 0.5 * acceleration * t**2 + turned(rate * t + 0.5 * alpha * t**2, OFFSET)

    h = 1e-4
    numeric = (path(h) - 2.0 * path(0.0) + path(-h)) / h**2
    assert acceleration_at(*OFFSET, *acceleration, alpha, rate) == pytest.approx(numeric, abs=1e-6)


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
