"""Prescribed performance: the law, its clock, and the damping that limits speeds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from coop_drake.laws import Funnel, TransitionGains, funnel_bounds, ppc
from coop_drake.laws.axis_table import (
    ACCELERATION_LIMIT,
    LAW_COLUMNS,
    LIMIT_GAIN,
    RATE_LIMIT,
    axis_table,
    bounds_of,
    gains_of,
    limited_row,
    track_row,
)
from coop_drake.laws.governor import AHEAD, driving_margin, energy_margin, steady_clearance
from tests.support.prescribed import prescribed_acceleration

FUNNEL = Funnel(
    slice_lower=np.array([0.0, -1.0, -1.0]),
    slice_upper=np.array([1.0, 1.0, 1.0]),
    goal_lower=np.array([0.8, -1.0, -0.2]),
    goal_upper=np.array([1.0, 1.0, 0.2]),
    decay_rate=np.array([2.0, 4.0, 8.0]),
)


GAINS = {"log_gain": np.array([1.0, 0.1, 0.1]), "position_gain": 1.0, "rate_gain": 8.0}


def test_a_gain_is_ramped_in_from_zero_with_its_rate():
    assert ppc.ramped_gain(0.0, 3.0, 2.0) == (0.0, 0.0)
    assert ppc.ramped_gain(50.0, 3.0, 2.0) == pytest.approx((3.0, 0.0), abs=1e-12)
    assert ppc.ramped_gain(0.7, 3.0, 0.0) == (3.0, 0.0)
    ahead, behind = (ppc.ramped_gain(0.7 + h, 3.0, 2.0)[0] for h in (1e-6, -1e-6))
    assert ppc.ramped_gain(0.7, 3.0, 2.0)[1] == pytest.approx((ahead - behind) / 2e-6, rel=1e-6)


@pytest.mark.parametrize("distance", [0.0, 1e-3, 1.0])
def test_beyond_a_wall_the_answer_is_finite_and_points_inside(distance):
    bounds = funnel_bounds(FUNNEL, 40.0)
    below = prescribed_acceleration(bounds.lower - distance, np.zeros(3), bounds, **GAINS)
    above = prescribed_acceleration(bounds.upper + distance, np.zeros(3), bounds, **GAINS)
    assert np.all(np.isfinite(below))
    assert np.all(below > 0.0)
    assert np.all(np.isfinite(above))
    assert np.all(above < 0.0)


@pytest.mark.parametrize("saturation", [1e-7, 0.02])
@pytest.mark.parametrize("time", [0.0, 0.3, 40.0])
def test_far_beyond_a_wall_the_answer_is_that_of_an_axis_just_inside(time, saturation):
    """Trial steps that overshoot must not overshoot more with each stage of the integrator."""
    bounds, rate = funnel_bounds(FUNNEL, time), np.array([0.1, 0.0, -0.4])
    inset, law = saturation * (bounds.upper - bounds.lower), {**GAINS, "saturation": saturation}
    below, above = bounds.lower - 1e9, bounds.upper + 1e9
    for inside, outside in ((bounds.lower + inset, below), (bounds.upper - inset, above)):
        near = prescribed_acceleration(inside, rate, bounds, **law)
        assert prescribed_acceleration(outside, rate, bounds, **law) == pytest.approx(near, rel=1e-6)


def row(shape="quintic", saturation=0.02):
    one = np.ones(1)
    funnel = Funnel(-0.1 * one, 0.3 * one, 0.05 * one, 0.12 * one, 3.0 * one, shape)
    gains = TransitionGains(
        stiffness=50.0, damping=5.0, governor_gain=5.0, smoothing=0.0, funnel=shape, decay_rate=3.0 * one,
        log_gain=0.05 * one, position_gain=11.0, rate_gain=28.0, ramp_rate=8.0, saturation=saturation,
        hand_over_time=0.0, energy_bound=one,
    )  # fmt: skip
    return axis_table(funnel, gains)[0]


@pytest.mark.parametrize("held", [0.0, 1.0])
@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (0.7, 0.2, 1.5), (1.0, 1.0, 0.3)])
def test_the_closed_form_solves_the_two_lags(held, start):
    def rates(_, state):
        a, b, _ = state
        return [ppc.HOLD_RATE * (held - a), ppc.HOLD_RATE * (a - b), b]

    solution = solve_ivp(rates, (0.0, 0.8), start, rtol=1e-11, atol=1e-12, t_eval=[0.05, 0.3, 0.8])
    for time, expected in zip(solution.t, solution.y.T, strict=True):
        a, b, b_rate, lost = ppc.lagging_clock(time, held, np.array(start))
        np.testing.assert_allclose([a, b, lost], expected, atol=1e-8)
        assert b_rate == pytest.approx(ppc.HOLD_RATE * (a - b))


def test_whatever_the_order_the_pace_stays_between_zero_and_one():
    generator, state = np.random.default_rng(3), np.zeros(3)
    for _ in range(200):
        held, time = float(generator.integers(2)), generator.exponential(0.1)
        a, b, _, lost = ppc.lagging_clock(time, held, state)
        assert 0.0 <= a <= 1.0
        assert 0.0 <= b <= 1.0
        assert 0.0 <= lost - state[2] <= time
        state = np.array([a, b, lost])


def test_after_the_settling_time_the_clock_has_its_final_pace():
    assert 1.0 - ppc.lagging_clock(ppc.SETTLING_TIME, 1.0, np.zeros(3))[1] < 1e-3
    assert ppc.lagging_clock(ppc.SETTLING_TIME, 0.0, np.array([1.0, 1.0, 0.0]))[1] < 1e-3


@pytest.mark.parametrize("shape", ["quintic", "exponential"])
def test_on_a_slowed_clock_the_law_tracks_the_bounds_as_they_move(shape):
    """The law on the clock is the law of bounds and gains whose rates are their derivatives by time."""
    axis, start, h = row(shape), np.array([0.6, 0.3, 0.05]), 1e-5

    def at(time):
        _, b, b_rate, lost = ppc.lagging_clock(time, 1.0, start)
        return 0.4 + time - lost, 1.0 - b, -b_rate

    def moving(time):
        return np.array([*bounds_of(axis, at(time)[0])[:2], gains_of(axis, at(time)[0])[1]])

    before, now, after = (moving(0.1 + step) for step in (-h, 0.0, h))
    rates, bending = (after - before) / (2.0 * h), (after - 2.0 * now + before) / h**2
    kappa, _, _, k2, saturation = gains_of(axis, at(0.1)[0])
    bounds = (*now[:2], *rates[:2], *bending[:2])
    expected = ppc.track_axis(0.07, 0.3, bounds, (kappa, now[2], rates[2], k2, saturation))
    tau, pace, pace_rate = at(0.1)
    assert track_row(axis, tau, 0.07, 0.3, pace, pace_rate) == pytest.approx(expected, rel=1e-4)


limits, gains = st.floats(0.05, 5.0), st.floats(0.5, 60.0)

parts = st.floats(-30.0, 30.0)


@settings(max_examples=200)
@given(st.tuples(parts, parts), st.tuples(parts, parts), limits, gains)
def test_damping_is_the_least_that_keeps_the_condition(acceleration, velocity, limit, gain):
    a, v = np.array(acceleration), np.array(velocity)
    room = 0.5 * gain * (limit**2 - v @ v)
    damping = ppc.speed_damping(float(a @ v), float(v @ v), limit, gain)
    assert damping >= 0.0
    if v @ v > 1e-12:
        assert (a - damping * v) @ v <= room + 1e-9 * (1.0 + abs(room) + abs(a @ v))
    if damping > 0.0:
        assert (a - damping * v) @ v == pytest.approx(room, rel=1e-9, abs=1e-9 * (1.0 + abs(a @ v)))
    else:
        assert a @ v <= room


def test_without_a_limit_or_at_rest_nothing_is_damped():
    assert ppc.speed_damping(1e6, 1e6, np.inf, 10.0) == 0.0
    assert ppc.speed_damping(0.0, 0.0, 0.1, 10.0) == 0.0
    assert ppc.speed_damping(5.0 * -0.05, 0.05**2, 0.1, 10.0) == 0.0  # braking is never limited


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


@pytest.mark.parametrize("quintic", [True, False])
def test_a_slowed_funnel_moves_at_a_share_of_the_limit(quintic):
    limit, shrink = 0.2, 0.6
    rate = ppc.slowed_decay_rate(13.0, shrink, quintic, limit)
    times = np.linspace(0.0, 10.0, 20001)
    fastest = max(abs(ppc.decay_factor(float(t), rate, quintic)[1]) for t in times) * shrink
    assert fastest == pytest.approx(ppc.FUNNEL_SHARE * limit, rel=1e-4)
    assert ppc.funnel_rate(np.array([rate]), shrink, quintic) == pytest.approx([fastest], rel=1e-4)
    assert ppc.slowed_decay_rate(13.0, shrink, quintic, np.inf) == 13.0
    assert ppc.slowed_decay_rate(1e-3, shrink, quintic, limit) == 1e-3


def test_what_drives_the_governor_counts_no_more_clearance_than_the_limit_needs():
    steady = steady_clearance(0.3, 100.0, 14.0, 12.0)
    most = AHEAD * steady
    energy = 0.02
    wide, narrow = energy_margin(energy, 2.0, 100.0), energy_margin(energy, 0.5 * most, 100.0)
    assert driving_margin(wide, 2.0, steady, 100.0) == pytest.approx(energy_margin(energy, most, 100.0))
    assert driving_margin(narrow, 0.5 * most, steady, 100.0) == narrow
    assert driving_margin(wide, 2.0, np.inf, 100.0) == wide
