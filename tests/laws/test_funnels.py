import numpy as np
import pytest

from coop_drake.laws import Funnel, funnel_bounds
from coop_drake.laws.gains import PEAK


def make_funnel(shape):
    return Funnel(
        slice_lower=np.array([0.0, -2.0]),
        slice_upper=np.array([1.0, 0.5]),
        goal_lower=np.array([0.7, -2.0]),
        goal_upper=np.array([0.9, 0.5]),
        decay_rate=np.array([2.0, 3.0]),
        shape=shape,
    )


@pytest.mark.parametrize("shape", ["exponential", "quintic"])
def test_walls_go_from_the_slice_to_the_goal(shape):
    funnel = make_funnel(shape)
    first, last = funnel_bounds(funnel, 0.0), funnel_bounds(funnel, 50.0)
    assert first.lower == pytest.approx(funnel.slice_lower, abs=1e-15)
    assert first.upper == pytest.approx(funnel.slice_upper, abs=1e-15)
    assert last.lower == pytest.approx(funnel.goal_lower, abs=1e-15)
    assert last.upper == pytest.approx(funnel.goal_upper, abs=1e-15)


def test_only_the_quintic_funnel_starts_at_rest():
    assert funnel_bounds(make_funnel("quintic"), 0.0).lower_rate.tolist() == [0.0, 0.0]
    assert funnel_bounds(make_funnel("quintic"), 0.0).upper_acceleration.tolist() == [0.0, 0.0]
    assert funnel_bounds(make_funnel("exponential"), 0.0).lower_rate == pytest.approx([1.4, 0.0])


def test_values_at_one_instant():
    lower = funnel_bounds(make_funnel("exponential"), 0.5).lower[0]
    assert lower == pytest.approx(0.7 * (1.0 - np.exp(-1.0)))
    u = 0.5 * 2.0 / 5.0
    quintic = funnel_bounds(make_funnel("quintic"), 0.5).upper[0]
    assert quintic == pytest.approx(0.9 + 0.1 * (1.0 - 10.0 * u**3 + 15.0 * u**4 - 6.0 * u**5))


@pytest.mark.parametrize("time", [0.0, 2.5])
def test_value_rate_and_acceleration_of_quintic_walls_are_continuous_at_both_ends(time):
    """The first axis' walls move for 5 / lambda = 2.5 s."""
    funnel, h = make_funnel("quintic"), 1e-9
    for early, late in zip(funnel_bounds(funnel, time), funnel_bounds(funnel, time + h), strict=True):
        assert late[0] == pytest.approx(early[0], abs=1e-7)


def test_quintic_walls_stand_exactly_at_the_goal_once_closed():
    closed = funnel_bounds(make_funnel("quintic"), 2.5)
    assert (closed.lower[0], closed.upper[0]) == (0.7, 0.9)
    assert [w[0] for w in closed[2:]] == [0.0] * 4


def test_no_quintic_wall_accelerates_more_than_the_schedule_counts_on():
    """PEAK lambda^2 shrink, found again by sampling."""
    funnel = make_funnel("quintic")
    seen = max(abs(funnel_bounds(funnel, t).lower_acceleration[0]) for t in np.linspace(0.0, 2.5, 2001))
    assert seen == pytest.approx(PEAK * 2.0**2 * 0.7, rel=1e-5)


def test_whole_seconds_are_seconds():
    assert (
        funnel_bounds(make_funnel("quintic"), 1).lower[0]
        == funnel_bounds(make_funnel("quintic"), 1.0).lower[0]
    )


def test_a_wall_without_shrink_stands_still():
    bounds = funnel_bounds(make_funnel("quintic"), 0.3)
    assert (bounds.lower[1], bounds.lower_rate[1], bounds.lower_acceleration[1]) == (-2.0, 0.0, 0.0)


def test_select_keeps_the_axes_asked_for():
    own = make_funnel("quintic").select(np.array([1]))
    assert funnel_bounds(own, 0.3).lower.tolist() == [funnel_bounds(make_funnel("quintic"), 0.3).lower[1]]
