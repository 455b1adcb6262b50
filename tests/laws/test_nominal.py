"""The nominal motion stays where its governor keeps it, and is carried exactly."""

from math import hypot

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.laws.governor import governed_acceleration
from coop_drake.laws.nominal import excursion, limited_step, nominal_flow, reach_of, tracked_acceleration

coordinates = st.floats(-1.0, 1.0)
gains = st.sampled_from([(50.0, 9.9), (150.0, 17.1), (100.0, 20.0), (100.0, 45.0)])


@pytest.mark.parametrize("damping", [5.0, 20.0, 60.0])
def test_the_flow_solves_the_equation_of_motion(damping):
    stiffness, period, steps = 100.0, 0.01, 4000
    state, h = np.array([0.3, -0.7]), period / steps
    flow = nominal_flow(stiffness, damping, period) @ state
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
    flow, before = nominal_flow(stiffness, damping, 0.005), excursion(x, y, vx, vy, stiffness)
    first = before
    for _ in range(200):
        (x, vx), (y, vy) = flow @ (x, vx), flow @ (y, vy)
        after = excursion(x, y, vx, vy, stiffness)
        assert after <= before * (1.0 + 1e-12) + 1e-15
        assert hypot(x, y) <= first * (1.0 + 1e-9) + 1e-15
        before = after


@settings(max_examples=60)
@given(coordinates, coordinates, st.floats(-0.1, 0.5), st.floats(0.05, 2.0))
def test_a_step_is_no_longer_than_allowed_and_keeps_its_direction(vx, vy, room, speed):
    dx, dy = limited_step(vx, vy, 0.005, speed, room)
    assert hypot(dx, dy) <= min(0.005 * speed, 0.5 * max(room, 0.0)) * (1.0 + 1e-12)
    assert dx * vy == pytest.approx(dy * vx, abs=1e-12)
    assert dx * vx + dy * vy >= 0.0
    free = limited_step(vx, vy, 0.005, 10.0, 10.0)
    assert free == (0.005 * vx, 0.005 * vy)


def test_no_way_is_longer_than_the_reach():
    """p_G that always flees from its target as quickly as the field could move it."""
    for distance, speed in ((0.001, 1.0), (0.05, 1.0), (0.5, 0.3)):
        way, off = 0.0, distance
        for periods in range(1, 9):
            step = min(0.005 * speed, 0.005 * 30.0 * off)
            way, off = way + step, off + step
            assert way <= reach_of(distance, 0.005, float(periods), speed) * (1.0 + 1e-12)


def test_on_the_nominal_motion_the_object_accelerates_as_it_does():
    own = governed_acceleration(0.1, 0.2, 0.15, 100.0, 14.0)
    same = (0.1, 0.2)
    assert tracked_acceleration(0.1, 0.2, 0.15, same, same, (100.0, 14.0, 250.0, 30.0)) == own
    off = tracked_acceleration(0.11, 0.2, 0.15, same, same, (100.0, 14.0, 250.0, 30.0))
    assert off == pytest.approx(own - 2.5)
