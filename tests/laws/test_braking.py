"""Drives brake with efforts in proportion to the inertia of their robot, against every rate."""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from coop_drake.laws.braking import braking_damping, braking_effort
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
