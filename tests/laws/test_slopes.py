import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coop_drake.laws import Funnel, TransitionGains
from coop_drake.laws.axis_table import axis_table, bounds_of, slope_bounds, track_row


def row(shape="quintic", saturation=0.02):
    one = np.ones(1)
    funnel = Funnel(-0.1 * one, 0.3 * one, 0.05 * one, 0.12 * one, 3.0 * one, shape)
    gains = TransitionGains(
        stiffness=50.0, damping=5.0, governor_gain=5.0, smoothing=0.0, funnel=shape, decay_rate=3.0 * one,
        log_gain=0.05 * one, position_gain=11.0, rate_gain=28.0, ramp_rate=8.0, saturation=saturation,
        hand_over_time=0.0, energy_bound=one,
    )  # fmt: skip
    return axis_table(funnel, gains)[0]


def inside(axis, time, share):
    lower, upper = bounds_of(axis, time)[:2]
    return lower + share * (upper - lower), upper - lower


@given(
    st.floats(0.0, 3.0),
    st.floats(0.03, 0.97),
    st.floats(-2.0, 2.0),
    st.sampled_from(["quintic", "exponential"]),
)
def test_slopes_are_those_of_differences_of_the_law(time, share, rate, shape):
    axis = row(shape)
    x, width = inside(axis, time, share)
    h = 1e-6 * width
    by_position = (track_row(axis, time, x + h, rate)[0] - track_row(axis, time, x - h, rate)[0]) / (2 * h)
    by_rate = (track_row(axis, time, x, rate + 1e-4)[0] - track_row(axis, time, x, rate - 1e-4)[0]) / 2e-4
    x_lower, x_upper, v_lower, v_upper = slope_bounds(axis, time, x, 0.0, rate)
    assert x_lower == pytest.approx(x_upper, rel=1e-9, abs=1e-9)
    assert by_position == pytest.approx(x_lower, rel=1e-4, abs=1e-3)
    assert (by_rate, by_rate) == pytest.approx((v_lower, v_upper), rel=1e-6, abs=1e-6)


@given(
    st.floats(0.0, 3.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(-2.0, 2.0), st.floats(-0.5, 0.5)
)
def test_differences_of_the_law_over_an_interval_keep_within_its_slopes(time, one, other, rate, step):
    axis = row()
    (x, _), (y, _) = inside(axis, time, one), inside(axis, time, other)
    x_lower, x_upper, v_lower, v_upper = slope_bounds(axis, time, 0.5 * (x + y), 0.5 * abs(x - y), rate)
    change = track_row(axis, time, x, rate)[0] - track_row(axis, time, y, rate)[0]
    room = 1e-9 * (1.0 + abs(x_lower) + abs(x_upper))
    assert min(x_lower * (x - y), x_upper * (x - y)) - room <= change
    assert change <= max(x_lower * (x - y), x_upper * (x - y)) + room
    turned = track_row(axis, time, x, rate + step)[0] - track_row(axis, time, x, rate)[0]
    assert min(v_lower * step, v_upper * step) - room <= turned <= max(v_lower * step, v_upper * step) + room
