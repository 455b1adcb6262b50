"""What the laws promise: funnels, prescribed performance, governor, shares of the load, hand-overs."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from coop_drake import laws
from coop_drake.laws.gains import schedule_of, scheduled_governor
from coop_drake.laws.ppc import ramped_gain
from coop_drake.laws.readiness import clearance_margin
from paper.governor_run import box_clearance, run_governor, straight_field
from tests.support.prescribed import prescribed_acceleration, prescribed_energy

law = settings(max_examples=200)
shapes = st.sampled_from(["exponential", "quintic"])
rates = st.floats(0.1, 20.0)
times = st.floats(0.0, 30.0)
fractions = st.floats(0.0, 1.0)


@st.composite
def funnels(draw):
    """Return a funnel of one axis whose goal interval lies in the slice, touches it or fills it."""
    lower, width = draw(st.floats(-7.0, 7.0)), draw(st.floats(1e-3, 7.0))
    start, part = draw(fractions), draw(st.floats(0.01, 1.0))
    goal_lower = lower + start * (1.0 - part) * width
    goal_upper = min(goal_lower + part * width, lower + width)
    arrays = [np.array([value]) for value in (lower, lower + width, goal_lower, goal_upper, draw(rates))]
    return laws.Funnel(*arrays, shape=draw(shapes))


@law
@given(funnels(), times, times)
def test_a_funnel_contains_its_goal_and_lies_in_its_slice(funnel, one, other):
    rounding = 1e-12
    early, late = laws.funnel_bounds(funnel, min(one, other)), laws.funnel_bounds(funnel, max(one, other))
    chain = [funnel.slice_lower, early.lower, late.lower, funnel.goal_lower]
    assert all(below <= above + rounding for below, above in pairwise(chain))
    chain = [funnel.goal_upper, late.upper, early.upper, funnel.slice_upper]
    assert all(below <= above + rounding for below, above in pairwise(chain))
    assert funnel.goal_lower < funnel.goal_upper


@law
@given(funnels(), times)
def test_rates_and_accelerations_of_the_walls_are_their_derivatives(funnel, time):
    h = 1e-5 / funnel.decay_rate[0]
    time = time + h
    bounds = laws.funnel_bounds(funnel, time)
    ahead, behind = laws.funnel_bounds(funnel, time + h), laws.funnel_bounds(funnel, time - h)
    scale = 1.0 + abs(funnel.slice_lower[0]) + abs(funnel.slice_upper[0])
    for value, derivative in (
        ("lower", "lower_rate"),
        ("upper", "upper_rate"),
        ("lower_rate", "lower_acceleration"),
        ("upper_rate", "upper_acceleration"),
    ):
        numeric = (getattr(ahead, value) - getattr(behind, value)) / (2.0 * h)
        # A value of size 15 is known to 2e-15; divided by 2 h it is known to some 1e-10 of the slope's scale.
        tolerance = 1e-8 * scale * (1.0 + funnel.decay_rate[0]) ** 3
        assert getattr(bounds, derivative) == pytest.approx(numeric, abs=tolerance)


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
    """V' along the flow, by central differences of V, is -kappa k1 s^2 - k2 (x' - v)^2, also in a ramp.

    So V never grows, and V is infinite at the walls: an axis stays in its funnel and ends in the middle.
    """
    time = time + 1e-3
    k1, k1_rate = ramped_gain(time, gain, mu)
    bounds = laws.funnel_bounds(funnel, time)
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
            laws.funnel_bounds(funnel, time + step),
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


LOWER, UPPER = np.array([0.0, -1.0]), np.array([4.0, 1.0])
places = st.tuples(st.floats(0.02, 0.98), st.floats(0.02, 0.98)).map(np.array)
table_2 = (50.0, 5.0, 5.0)
scheduled = [(k, np.sqrt(k), 0.8 * np.sqrt(k)) for k in (50.0, 400.0)]


@pytest.mark.slow
@settings(max_examples=20)
@given(
    st.sampled_from([table_2, *scheduled]),
    st.sampled_from([0.0, 0.001]),
    places,
    places,
    st.floats(-np.pi, np.pi),
    st.sampled_from([0.0, 0.1, 0.5, 0.95]),
    st.sampled_from([0.0, 0.3, 1.0]),
)
def test_the_margin_never_becomes_negative(gains, smoothing, start, target, heading, filled, split):
    """From any start whose energy fills a part of what the clearance allows, as speed or as distance."""
    governor, target = LOWER + start * (UPPER - LOWER), LOWER + target * (UPPER - LOWER)
    clearance = box_clearance(LOWER, UPPER)
    stiffness = gains[0]
    energy = filled * laws.energy_margin(0.0, clearance(governor), stiffness)
    direction = np.array([np.cos(heading), np.sin(heading)])
    velocity = np.sqrt(2.0 * split * energy) * direction
    position = governor + np.sqrt(2.0 * (1.0 - split) * energy / stiffness) * direction
    assume(
        laws.tracking_energy(*(position - governor), *velocity, stiffness) <= energy * (1.0 + 1e-9) + 1e-12
    )
    run = run_governor(
        clearance,
        straight_field(target),
        position=position,
        velocity=velocity,
        governor=governor,
        gains=(*gains, smoothing),
        seconds=12.0,
    )
    assert run.margin.min() >= -1e-9
    assert min(clearance(p) for p in run.position) >= 0.0
    assert run.position[-1] == pytest.approx(target, abs=0.01)


@settings(max_examples=10)
@given(st.floats(0.01, 0.4), st.floats(0.01, 0.4), st.floats(0.0, 1.0), st.sampled_from([0.0, 0.001]))
def test_every_hand_over_is_reached_and_leaves_margin(half_height, half_overlap, heading, smoothing):
    """Two corridors of any width overlap in a box: its pole is reached with margin to spare.

    The next cell has its own stiffness, and the object comes with the speed that the last one allowed.
    """
    here = box_clearance(LOWER, np.array([3.0 + half_overlap, 1.0]))
    height = np.array([0.0, half_height])
    following = box_clearance(np.array([3.0 - half_overlap, 0.0]) - height, np.array([5.0, 0.0]) + height)
    target, inradius = np.array([3.0, 0.0]), min(half_height, half_overlap)
    stiffness = scheduled_governor(schedule_of(laws.ScheduledGains()), half_height)[0]
    start = np.array([0.3, 1.8 * heading - 0.9])
    run = run_governor(
        here,
        straight_field(target),
        position=start,
        velocity=np.zeros(2),
        governor=start,
        gains=(50.0, np.sqrt(50.0), 0.8 * np.sqrt(50.0), smoothing),
        seconds=15.0,
    )
    margins = [
        laws.energy_margin(laws.tracking_energy(*(p - g), *v, stiffness), following(g), stiffness)
        for p, v, g in zip(run.position, run.velocity, run.governor, strict=True)
    ]
    ready = [clearance_margin(m, stiffness, inradius) >= 0.0 for m in margins]
    first = ready.index(True)
    assert following(run.position[first]) > 0.0
    assert here(run.position[first]) > 0.0
    # Nothing takes the readiness away again while other conditions are still waited for, once at rest.
    assert ready[-1]
    assert clearance_margin(margins[-1], stiffness, inradius) == pytest.approx(0.75, abs=0.01)
