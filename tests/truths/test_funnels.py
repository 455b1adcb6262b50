"""A funnel contains its goal and lies in its slice at all times, and rates are derivatives of bounds."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.laws import Funnel, funnel_bounds

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
    return Funnel(*arrays, shape=draw(shapes))


@law
@given(funnels(), times, times)
def test_a_funnel_contains_its_goal_and_lies_in_its_slice(funnel, one, other):
    rounding = 1e-12
    early, late = funnel_bounds(funnel, min(one, other)), funnel_bounds(funnel, max(one, other))
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
    bounds = funnel_bounds(funnel, time)
    ahead, behind = funnel_bounds(funnel, time + h), funnel_bounds(funnel, time - h)
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
