import numpy as np
import pytest

from coop_drake.laws import Funnel, funnel_bounds


def make_funnel(shape):
    return Funnel(
        slice_lower=np.array([0.0, -2.0]),
        slice_upper=np.array([1.0, 0.5]),
        goal_lower=np.array([0.7, -2.0]),
        goal_upper=np.array([0.9, 0.5]),
        decay_rate=np.array([2.0, 3.0]),
        shape=shape,
    )


@pytest.mark.parametrize("shape", ["exponential", "smooth"])
def test_walls_go_from_the_slice_to_the_goal(shape):
    funnel = make_funnel(shape)
    first, last = funnel_bounds(funnel, 0.0), funnel_bounds(funnel, 50.0)
    assert first.lower == pytest.approx(funnel.slice_lower, abs=1e-15)
    assert first.upper == pytest.approx(funnel.slice_upper, abs=1e-15)
    assert last.lower == pytest.approx(funnel.goal_lower, abs=1e-15)
    assert last.upper == pytest.approx(funnel.goal_upper, abs=1e-15)


def test_only_the_smooth_funnel_starts_at_rest():
    assert funnel_bounds(make_funnel("smooth"), 0.0).lower_rate.tolist() == [0.0, 0.0]
    assert funnel_bounds(make_funnel("exponential"), 0.0).lower_rate == pytest.approx([1.4, 0.0])


def test_values_at_one_instant():
    lower = funnel_bounds(make_funnel("exponential"), 0.5).lower[0]
    assert lower == pytest.approx(0.7 * (1.0 - np.exp(-1.0)))
    smooth = funnel_bounds(make_funnel("smooth"), 0.5).upper[0]
    assert smooth == pytest.approx(0.9 + 0.1 * 2.0 * np.exp(-1.0))


def test_whole_seconds_are_seconds():
    assert (
        funnel_bounds(make_funnel("smooth"), 1).lower[0] == funnel_bounds(make_funnel("smooth"), 1.0).lower[0]
    )


def test_a_wall_without_shrink_stands_still():
    bounds = funnel_bounds(make_funnel("smooth"), 0.3)
    assert (bounds.lower[1], bounds.lower_rate[1], bounds.lower_acceleration[1]) == (-2.0, 0.0, 0.0)


def test_select_keeps_the_axes_asked_for():
    own = make_funnel("smooth").select(np.array([1]))
    assert funnel_bounds(own, 0.3).lower.tolist() == [funnel_bounds(make_funnel("smooth"), 0.3).lower[1]]
