"""Drives brake with efforts in proportion to the inertia of their robot, against every rate."""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.laws.braking import RETURN_RATE, braking_damping, braking_effort
from coop_drake.plant import build_team_plant
from coop_drake.plant.team import base_inertia
from tests.support.small_scenario import small_scenario


def test_the_damping_follows_from_the_model_of_the_base():
    team = build_team_plant(small_scenario("base"), DiagramBuilder())
    mass, inertia = base_inertia(team.robots[0])
    assert (mass, inertia) == pytest.approx((6.0, 0.1875))
    damping = braking_damping(mass, inertia, 1)
    assert damping == pytest.approx([100.0, 100.0, 1.0, 1.0])
    assert braking_damping(2.0 * mass, 3.0 * inertia, 1) == pytest.approx([200.0, 200.0, 3.0, 1.0])


def test_the_power_of_braking_is_negative():
    damping = braking_damping(6.0, 0.2, 2)
    for seed in range(20):
        state = np.random.default_rng(seed).normal(size=10)
        assert braking_effort(state, damping) @ state[5:] < 0.0


def test_drives_pull_to_the_rest_that_they_were_told_and_a_turn_of_the_yaw_is_none():
    damping, rest = braking_damping(6.0, 0.2, 1), np.array([1.0, 2.0, 3.1, 0.4])
    still = np.concatenate([rest - [0.0, 0.0, 2.0 * np.pi, 0.0], np.zeros(4)])
    assert braking_effort(still, damping, rest) == pytest.approx(np.zeros(4), abs=1e-12)
    away = np.concatenate([rest + 0.1, np.zeros(4)])
    assert braking_effort(away, damping, rest) == pytest.approx(-0.1 * RETURN_RATE * damping)


def test_two_loads_that_brake_towards_the_rest_of_a_motion_overshoot_less_than_they_would_coast():
    for mass in (3.0, 8.5, 20.0):
        damping, T, farthest = braking_damping(6.0, 0.2, 0), 1e-3, []
        for rest in (np.zeros(3), None):
            state, far = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), 0.0
            for _ in range(6000):
                state[3:] += T * braking_effort(state, damping, rest) / [mass, mass, 0.2]
                state[:3] += T * state[3:]
                far = max(far, state[0])
            farthest.append(far)
            assert abs(state[3]) < 1e-3
        assert farthest[0] < farthest[1]
