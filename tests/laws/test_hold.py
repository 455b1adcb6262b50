"""The clock that slows down, and bounds that follow it, against integration and differences."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from coop_drake.laws.ppc import HOLD_RATE, SETTLING_TIME, axis_bounds, lagging_clock, slowed_bounds


@pytest.mark.parametrize("held", [0.0, 1.0])
@pytest.mark.parametrize("start", [(0.0, 0.0, 0.0), (0.7, 0.2, 1.5), (1.0, 1.0, 0.3)])
def test_the_closed_form_solves_the_two_lags(held, start):
    def rates(_, state):
        a, b, _ = state
        return [HOLD_RATE * (held - a), HOLD_RATE * (a - b), b]

    solution = solve_ivp(rates, (0.0, 0.8), start, rtol=1e-11, atol=1e-12, t_eval=[0.05, 0.3, 0.8])
    for time, expected in zip(solution.t, solution.y.T, strict=True):
        a, b, b_rate, lost = lagging_clock(time, held, np.array(start))
        np.testing.assert_allclose([a, b, lost], expected, atol=1e-8)
        assert b_rate == pytest.approx(HOLD_RATE * (a - b))


def test_whatever_the_order_the_pace_stays_between_zero_and_one():
    generator, state = np.random.default_rng(3), np.zeros(3)
    for _ in range(200):
        held, time = float(generator.integers(2)), generator.exponential(0.1)
        a, b, _, lost = lagging_clock(time, held, state)
        assert 0.0 <= a <= 1.0
        assert 0.0 <= b <= 1.0
        assert 0.0 <= lost - state[2] <= time
        state = np.array([a, b, lost])


def test_after_the_settling_time_the_clock_has_its_final_pace():
    assert 1.0 - lagging_clock(SETTLING_TIME, 1.0, np.zeros(3))[1] < 1e-3
    assert lagging_clock(SETTLING_TIME, 0.0, np.array([1.0, 1.0, 0.0]))[1] < 1e-3


@pytest.mark.parametrize("quintic", [True, False])
def test_rates_of_slowed_bounds_are_their_derivatives(quintic):
    funnel, start, h = (-1.0, 0.8, -0.2, 0.1, 3.0, quintic), np.array([0.6, 0.3, 0.05]), 1e-5

    def at(time):
        _, b, b_rate, lost = lagging_clock(time, 1.0, start)
        return slowed_bounds(axis_bounds(0.4 + time - lost, *funnel), 1.0 - b, -b_rate)

    before, now, after = (np.array(at(0.1 + step)) for step in (-h, 0.0, h))
    np.testing.assert_allclose(now[2:4], (after[:2] - before[:2]) / (2.0 * h), atol=1e-7)
    np.testing.assert_allclose(now[4:], (after[2:4] - before[2:4]) / (2.0 * h), atol=1e-6)
