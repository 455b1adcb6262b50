"""The disturbance observer as a law: a coordinate with v' = command + d, whatever the law asks for."""

import numpy as np
import pytest

from coop_drake.laws.measurements import FASTEST, LEAK, PHASE, observe, observer_gains

GAIN, LEAK_RATE = 8.0, 1.6


def estimates(disturbance, wanted, gain=GAIN, leak=LEAK_RATE, step=1e-4, end=3.0):
    """The estimate at every step, the command being what is wanted less the estimate."""
    rate, state, found = np.array([0.3]), np.array([0.3]), []
    state_rate, estimate = np.empty(1), np.empty(1)
    for time in np.arange(0.0, end, step):
        u = np.array([wanted(time, rate[0])])
        observe(rate, u, state, gain, leak, state_rate, estimate)
        found.append(estimate[0])
        rate = rate + step * (u - estimate + disturbance(time))
        state = state + step * state_rate
    return np.array(found)


def test_the_estimate_is_a_low_pass_of_the_disturbance_whatever_the_law_does():
    times = np.arange(0.0, 3.0, 1e-4)
    expected = 2.0 * GAIN / (GAIN + LEAK_RATE) * (1.0 - np.exp(-(GAIN + LEAK_RATE) * times))
    for wanted in (
        lambda time, rate: 0.0,
        lambda time, rate: 5.0 * np.sin(7.0 * time),
        lambda time, rate: -30.0 * rate,
        lambda time, rate: 40.0 if 1.0 < time < 1.1 else 0.0,
    ):
        found = estimates(lambda time: 2.0, wanted)
        np.testing.assert_allclose(found, expected, atol=2e-3)


def test_without_a_leak_a_constant_disturbance_is_found_whole():
    assert estimates(lambda time: -3.0, lambda time, rate: -rate, leak=0.0)[-1] == pytest.approx(-3.0)


@pytest.mark.parametrize(("frequency", "lowest", "highest"), [(1.0, 1.6, 1.7), (100.0, 0.0, 0.2)])
def test_it_follows_slow_disturbances_and_not_quick_ones(frequency, lowest, highest):
    found = estimates(lambda time: np.sin(frequency * time), lambda time, rate: -rate, step=1e-3, end=8.0)
    assert lowest < np.ptp(found[1000:]) < highest


def test_two_robots_that_want_different_things_do_not_drift_apart_for_ever():
    """Each gives half of the acceleration, and takes what the other one does for a disturbance."""
    rate, states, estimate = 0.0, np.zeros(2), np.zeros(2)
    state_rate, wanted, step = np.zeros(2), np.array([0.1, -0.1]), 1e-3
    for _ in range(20000):
        observe(np.full(2, rate), wanted, states, GAIN, LEAK_RATE, state_rate, estimate)
        rate += step * float((wanted - estimate).mean())
        states += step * state_rate
    assert rate == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(estimate, -wanted * GAIN / LEAK_RATE, rtol=1e-6)


@pytest.mark.parametrize(("age", "gain"), [(0.0, FASTEST), (0.001, FASTEST), (0.05, PHASE / 0.05)])
def test_gains_follow_the_age_of_commands(age, gain):
    assert observer_gains(age) == (gain, pytest.approx(LEAK * gain))


@pytest.mark.parametrize("age", [0.0125, 0.05, 0.2])
def test_the_observer_s_loop_is_well_damped_with_the_age_as_a_delay(age):
    """d^'(t) = l (d - d^(t - age)) - g d^(t) does not overshoot by more than a hundredth."""
    gain, leak = observer_gains(age)
    step = age / 100.0
    found = np.zeros(100)
    for _ in range(int(20.0 / gain / step)):
        found = np.append(found, found[-1] + step * (gain * (1.0 - found[-100]) - leak * found[-1]))
    final = gain / (gain + leak)
    assert found[-1] == pytest.approx(final, rel=1e-3)
    assert found.max() <= 1.01 * final
