import numpy as np
import pytest

from coop_drake.laws import Funnel, funnel_bounds
from coop_drake.laws.ppc import ramped_gain
from tests.support.prescribed import prescribed_acceleration, prescribed_energy

FUNNEL = Funnel(
    slice_lower=np.array([0.0, -1.0, -1.0]),
    slice_upper=np.array([1.0, 1.0, 1.0]),
    goal_lower=np.array([0.8, -1.0, -0.2]),
    goal_upper=np.array([1.0, 1.0, 0.2]),
    decay_rate=np.array([2.0, 4.0, 8.0]),
)
GAINS = {"log_gain": np.array([1.0, 0.1, 0.1]), "position_gain": 1.0, "rate_gain": 8.0}


def literal_law(x, v, bounds, kappa, k1, k2, k1_rate=0.0):
    """Return the back-stepping law of one axis in the letters of (18)-(20), v' by the chain rule."""
    lo, up, lo1, up1, lo2, up2 = bounds
    z1 = np.log((x - lo) / (up - x))
    a = 1.0 / (x - lo) + 1.0 / (up - x)
    b = lo1 / (x - lo) + up1 / (up - x)
    a1 = -(v - lo1) / (x - lo) ** 2 - (up1 - v) / (up - x) ** 2
    b1 = lo2 / (x - lo) + up2 / (up - x) - lo1 * (v - lo1) / (x - lo) ** 2 - up1 * (up1 - v) / (up - x) ** 2
    wanted = (b - k1 * z1) / a
    wanted_rate = (b1 - k1_rate * z1 - k1 * (a * v - b)) / a - wanted * a1 / a
    return -k2 * (v - wanted) + wanted_rate - kappa * a * z1


@pytest.mark.parametrize("time", [0.0, 0.1, 0.7, 5.0])
def test_the_law_with_a_ramped_gain_is_that_of_the_paper_with_its_rate(time):
    bounds = funnel_bounds(FUNNEL, time)
    x, v = 0.3 * bounds.lower + 0.7 * bounds.upper, np.array([0.4, -0.3, 1.0])
    k1, k1_rate = ramped_gain(time, 3.0, 2.0)
    ramped = {**GAINS, "position_gain": k1, "position_gain_rate": k1_rate}
    acceleration = prescribed_acceleration(x, v, bounds, **ramped)
    for i in range(3):
        kappa, walls = GAINS["log_gain"][i], [w[i] for w in bounds]
        literal = literal_law(x[i], v[i], walls, kappa, k1, 8.0, k1_rate)
        assert acceleration[i] == pytest.approx(literal, rel=1e-9, abs=1e-9)


def test_a_gain_is_ramped_in_from_zero_with_its_rate():
    assert ramped_gain(0.0, 3.0, 2.0) == (0.0, 0.0)
    assert ramped_gain(50.0, 3.0, 2.0) == pytest.approx((3.0, 0.0), abs=1e-12)
    assert ramped_gain(0.7, 3.0, 0.0) == (3.0, 0.0)
    ahead, behind = (ramped_gain(0.7 + h, 3.0, 2.0)[0] for h in (1e-6, -1e-6))
    assert ramped_gain(0.7, 3.0, 2.0)[1] == pytest.approx((ahead - behind) / 2e-6, rel=1e-6)


@pytest.mark.parametrize("time", [0.0, 0.1, 0.7, 5.0])
def test_the_law_is_that_of_the_paper_in_its_own_letters(time):
    bounds = funnel_bounds(FUNNEL, time)
    x, v = 0.3 * bounds.lower + 0.7 * bounds.upper, np.array([0.4, -0.3, 1.0])
    acceleration = prescribed_acceleration(x, v, bounds, **GAINS)
    for i in range(3):
        literal = literal_law(x[i], v[i], [w[i] for w in bounds], GAINS["log_gain"][i], 1.0, 8.0)
        assert acceleration[i] == pytest.approx(literal, rel=1e-9, abs=1e-9)


def test_rest_in_the_middle_of_still_walls_is_an_equilibrium():
    bounds = funnel_bounds(FUNNEL, 40.0)
    middle = 0.5 * (bounds.lower + bounds.upper)
    assert prescribed_acceleration(middle, np.zeros(3), bounds, **GAINS) == pytest.approx(
        np.zeros(3), abs=1e-12
    )
    energy = prescribed_energy(middle, np.zeros(3), bounds, log_gain=GAINS["log_gain"], position_gain=1.0)
    assert energy == pytest.approx(np.zeros(3), abs=1e-24)


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


def test_energy_is_the_log_term_plus_the_rate_error():
    bounds = funnel_bounds(FUNNEL, 40.0)
    x = 0.25 * bounds.lower + 0.75 * bounds.upper
    wanted = -np.log(3.0) * 0.25 * 0.75 * (bounds.upper - bounds.lower)
    energy = prescribed_energy(x, wanted + 0.5, bounds, log_gain=GAINS["log_gain"], position_gain=1.0)
    assert energy == pytest.approx(0.5 * GAINS["log_gain"] * np.log(3.0) ** 2 + 0.125)
