"""Extra damping keeps a speed below its limit, and takes away nothing that a funnel or the governor needs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from coop_drake.laws.axis_table import ACCELERATION_LIMIT, LAW_COLUMNS, LIMIT_GAIN, RATE_LIMIT, limited_row
from coop_drake.laws.governor import AHEAD, driving_margin, energy_margin, steady_clearance
from coop_drake.laws.ppc import (
    FUNNEL_SHARE,
    damped,
    decay_factor,
    funnel_rate,
    slowed_decay_rate,
    speed_damping,
)

limits, gains = st.floats(0.05, 5.0), st.floats(0.5, 60.0)
parts = st.floats(-30.0, 30.0)


@settings(max_examples=200)
@given(st.tuples(parts, parts), st.tuples(parts, parts), limits, gains)
def test_damping_is_the_least_that_keeps_the_condition(acceleration, velocity, limit, gain):
    a, v = np.array(acceleration), np.array(velocity)
    room = 0.5 * gain * (limit**2 - v @ v)
    damping = speed_damping(float(a @ v), float(v @ v), limit, gain)
    assert damping >= 0.0
    if v @ v > 1e-12:
        assert (a - damping * v) @ v <= room + 1e-9 * (1.0 + abs(room) + abs(a @ v))
    if damping > 0.0:
        assert (a - damping * v) @ v == pytest.approx(room, rel=1e-9, abs=1e-9 * (1.0 + abs(a @ v)))
    else:
        assert a @ v <= room


def test_without_a_limit_or_at_rest_nothing_is_damped():
    assert speed_damping(1e6, 1e6, np.inf, 10.0) == 0.0
    assert speed_damping(0.0, 0.0, 0.1, 10.0) == 0.0
    assert damped(-7.0, 3.0, np.inf, 10.0) == -7.0
    assert damped(5.0, -0.05, 0.1, 10.0) == 5.0  # braking is never limited


@settings(max_examples=200, deadline=None, derandomize=True)
@given(parts, st.floats(-1.0, 1.0), limits, gains, st.floats(0.1, 20.0))
def test_no_more_than_the_limit_of_acceleration_is_commanded(acceleration, share, limit, gain, most):
    row = np.full(LAW_COLUMNS, np.nan)
    row[RATE_LIMIT], row[LIMIT_GAIN], row[ACCELERATION_LIMIT] = limit, gain, most
    commanded = limited_row(row, acceleration, share * limit)
    assert abs(commanded) <= min(abs(acceleration), most) * (1.0 + 1e-12)
    assert commanded * share * limit <= 0.5 * gain * limit**2 * (1.0 - share**2) + 1e-9
    row[RATE_LIMIT] = np.inf
    assert limited_row(row, acceleration, share * limit) == np.clip(acceleration, -most, most)


@pytest.mark.parametrize("seed", range(4))
def test_a_speed_that_begins_below_its_limit_stays_below_it(seed):
    generator = np.random.default_rng(seed)
    waves, (limit, gain) = generator.uniform(-20.0, 20.0, (2, 3)), generator.uniform([0.1, 5.0], [1.0, 30.0])

    def flow(t, v):
        a = waves @ np.sin(np.array([1.0, 3.0, 7.0]) * t + np.arange(3))
        return a - speed_damping(float(a @ v), float(v @ v), limit, gain) * v

    run = solve_ivp(
        flow, (0.0, 2.0), [generator.uniform(0.0, limit), 0.0], method="LSODA", rtol=1e-7, atol=1e-9
    )
    speeds = np.hypot(*run.y)
    assert 0.9 * limit < speeds.max() <= limit * (1.0 + 1e-5)


@pytest.mark.parametrize("quintic", [True, False])
def test_a_slowed_funnel_moves_at_a_share_of_the_limit(quintic):
    limit, shrink = 0.2, 0.6
    rate = slowed_decay_rate(13.0, shrink, quintic, limit)
    times = np.linspace(0.0, 10.0, 20001)
    fastest = max(abs(decay_factor(float(t), rate, quintic)[1]) for t in times) * shrink
    assert fastest == pytest.approx(FUNNEL_SHARE * limit, rel=1e-4)
    assert funnel_rate(rate, shrink, quintic) == pytest.approx(fastest, rel=1e-4)
    assert slowed_decay_rate(13.0, shrink, quintic, np.inf) == 13.0
    assert slowed_decay_rate(1e-3, shrink, quintic, limit) == 1e-3


def test_what_drives_the_governor_counts_no_more_clearance_than_the_limit_needs():
    steady = steady_clearance(0.3, 100.0, 14.0, 12.0)
    most = AHEAD * steady
    energy = 0.02
    wide, narrow = energy_margin(energy, 2.0, 100.0), energy_margin(energy, 0.5 * most, 100.0)
    assert driving_margin(wide, 2.0, steady, 100.0) == pytest.approx(energy_margin(energy, most, 100.0))
    assert driving_margin(narrow, 0.5 * most, steady, 100.0) == narrow
    assert driving_margin(wide, 2.0, np.inf, 100.0) == wide
