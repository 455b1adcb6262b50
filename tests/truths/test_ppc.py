"""Prescribed performance control keeps an axis inside its funnel, and its energy decays as predicted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from coop_drake.laws import Funnel, funnel_bounds
from coop_drake.laws.ppc import ramped_gain
from tests.support.prescribed import prescribed_acceleration, prescribed_energy
from tests.truths.test_funnels import funnels

inside = st.floats(0.05, 0.95)
speeds = st.floats(-1.0, 1.0)
log_gains = st.floats(0.01, 1.0)
gains = st.floats(0.5, 10.0)


def energy_and_terms(x, v, bounds, kappa, k1):
    """Return V, s and x' - v, computed apart from the law itself."""
    dl, du = x - bounds.lower[0], bounds.upper[0] - x
    s = np.log(dl / du)
    wanted = (bounds.lower_rate[0] * du + bounds.upper_rate[0] * dl - k1 * s * dl * du) / (dl + du)
    return 0.5 * kappa * s**2 + 0.5 * (v - wanted) ** 2, s, v - wanted


@settings(max_examples=200)
@given(
    funnels(), st.floats(0.0, 3.0), inside, speeds, log_gains, gains, gains, st.sampled_from([0.0, 2.0, 8.0])
)
def test_the_energy_decays_as_predicted(funnel, time, fraction, v, kappa, gain, k2, mu):
    """V' along the flow, by central differences of V, is -kappa k1 s^2 - k2 (x' - v)^2, also in a ramp."""
    time = time + 1e-3
    k1, k1_rate = ramped_gain(time, gain, mu)
    bounds = funnel_bounds(funnel, time)
    x = (1.0 - fraction) * bounds.lower + fraction * bounds.upper
    width = (bounds.upper - bounds.lower)[0]
    v *= width
    law = {"log_gain": np.array([kappa]), "position_gain": k1, "rate_gain": k2}
    acceleration = prescribed_acceleration(x, np.array([v]), bounds, **law, position_gain_rate=k1_rate)[0]
    value, s, error = energy_and_terms(x[0], v, bounds, kappa, k1)
    assert prescribed_energy(x, np.array([v]), bounds, log_gain=law["log_gain"], position_gain=k1)[0] == (
        pytest.approx(value, rel=1e-9, abs=1e-12)
    )
    h = 1e-5 / (
        1.0 + gain + k2 + mu + funnel.decay_rate[0] + abs(v) / width + np.sqrt(abs(acceleration) / width)
    )

    def along(step):
        moved = x[0] + v * step + 0.5 * acceleration * step**2
        return energy_and_terms(
            moved,
            v + acceleration * step,
            funnel_bounds(funnel, time + step),
            kappa,
            ramped_gain(time + step, gain, mu)[0],
        )[0]

    numeric = (along(h) - along(-h)) / (2.0 * h)
    predicted = -kappa * k1 * s**2 - k2 * error**2
    # Rounding of the positions moves V by its slope in x, and the difference over 2 h magnifies that.
    rounding = 2.0**-52 * (1.0 + abs(x[0]))
    slope = kappa * abs(s) / (fraction * (1.0 - fraction) * width)
    slope += abs(error) * (gain * (1.0 + abs(s)) + funnel.decay_rate[0] * 10.0)
    noise = 4.0 * (rounding * slope + 2.0**-52 * (1.0 + value)) / h
    assert numeric == pytest.approx(predicted, rel=1e-5, abs=noise + 1e-6 * value)


@pytest.mark.slow
@settings(max_examples=25)
@given(
    st.sampled_from(["exponential", "quintic"]),
    st.floats(0.2, 0.5),
    st.floats(0.0, 1.0),
    inside,
    speeds,
    st.floats(1.0, 8.0),
    st.sampled_from([(1.0, 1.0, 1.0, 0.0), (0.1, 1.0, 8.0, 0.0), (0.05, 11.2, 28.0, 8.4)]),
)
def test_an_axis_stays_in_its_funnel_and_ends_in_the_middle_of_its_goal(
    shape, part, place, start, speed, rate, k
):
    """Simulated with an adaptive integrator over a funnel that closes to a part of its slice."""
    goal_lower = place * (1.0 - part)
    funnel = Funnel(
        np.zeros(1),
        np.ones(1),
        np.array([goal_lower]),
        np.array([goal_lower + part]),
        np.array([rate]),
        shape,
    )
    kappa, gain, k2, mu = k

    def law(t):
        return {"log_gain": np.array([kappa]), "position_gain": ramped_gain(t, gain, mu)[0]}

    def flow(t, state):
        rates = {"rate_gain": k2, "position_gain_rate": ramped_gain(t, gain, mu)[1]}
        bounds = funnel_bounds(funnel, t)
        return np.array(
            [state[1], prescribed_acceleration(state[:1], state[1:], bounds, **law(t), **rates)[0]]
        )

    run = solve_ivp(flow, (0.0, 25.0), [start, speed], method="DOP853", rtol=1e-9, atol=1e-11)
    assert run.success
    energies = []
    for t, x, v in zip(run.t, *run.y, strict=True):
        bounds = funnel_bounds(funnel, t)
        assert bounds.lower[0] < x < bounds.upper[0]
        energies.append(prescribed_energy(np.array([x]), np.array([v]), bounds, **law(t))[0])
    assert np.all(np.diff(energies) <= 1e-7 * (1.0 + energies[0]))
    # V' <= -2 min(k1, k2) V, so 25 s leave e^-50 of it; the integrator leaves more.
    assert energies[-1] < 1e-10
    assert run.y[0, -1] == pytest.approx(goal_lower + 0.5 * part, abs=1e-4)
