"""The estimate of times, and limits of bases that are shared."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import box

from coop_drake.geometry import BoundaryDistance
from coop_drake.laws import FixedGains, ScheduledGains, transition_gains
from coop_drake.planning import make_plan, plan_time
from coop_drake.planning.duration import speed_per_clearance, timed, transition_time, travel_time
from coop_drake.planning.limits import fill
from paper.governor_run import run_governor
from tests.support.channels import bent_channel
from tests.support.point_mass import build_fields, carry_out, straight_fields
from tests.support.small_plan import small_plan

# Estimated times against the rule and against a transport carried out.


def test_a_transition_takes_settling_and_travel():
    assert transition_time(3.0, 0.1) == pytest.approx(10.6)
    assert travel_time(0.0, 0.1) == 0.0


@pytest.mark.parametrize("gain_set", [FixedGains(), ScheduledGains()])
def test_speed_in_a_long_aisle_is_that_of_a_governed_point(gain_set):
    half_width = 0.15
    aisle = box(0.0, -half_width, 30.0, half_width)
    lower, upper = np.array([-1.0]), np.array([1.0])
    gains = transition_gains(
        gain_set, clearance=half_width, slice_lower=lower, slice_upper=upper,
        goal_lower=lower, goal_upper=upper, resting=np.zeros(1),
    )  # fmt: skip
    run = run_governor(
        BoundaryDistance(aisle), lambda point: np.array([1.0, 0.0]), position=np.array([2.0, 0.0]),
        velocity=np.zeros(2), governor=np.array([2.0, 0.0]), seconds=8.0, tolerance=1e-8,
        gains=(gains.stiffness, gains.damping, gains.governor_gain, 0.0),
    )  # fmt: skip
    assert run.velocity[-1, 0] == pytest.approx(speed_per_clearance(gains) * half_width, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("gain_set", [FixedGains(), ScheduledGains()])
def test_the_estimate_is_that_of_a_transport_through_maps(gain_set):
    plan = make_plan(*bent_channel(cells=4), gain_set, gain_set_name="any")
    transport = carry_out(plan, build_fields(plan))
    assert transport.stuck is None
    assert transport.least_energy_margin > 0.0
    assert plan_time(plan) == pytest.approx(float(np.sum(transport.durations)), rel=0.1)


def test_without_walls_in_the_way_every_transition_is_estimated_closely():
    plan = small_plan(("arm",))
    transport = carry_out(timed(plan), straight_fields(plan))
    estimates = [transition.estimated_time for transition in timed(plan).transitions]
    np.testing.assert_allclose(estimates, transport.durations, atol=0.06)


def test_a_transition_that_is_never_left_gets_the_rule_and_two_minutes():
    plan = small_plan(("arm",))
    gains = replace(plan.transitions[0].gains, energy_bound=np.full(2, 1e-12))
    shut = replace(
        plan, transitions=(plan.transitions[0], *(replace(t, gains=gains) for t in plan.transitions[1:]))
    )
    first = timed(shut).transitions[0]
    rule = transition_time(first.length, first.neck, speed_per_clearance(first.gains))
    assert first.estimated_time == 120.0 + rule


def test_a_plan_read_from_a_file_is_estimated_as_it_was_when_made():
    plan = make_plan(*bent_channel(cells=4), ScheduledGains(), gain_set_name="any")
    assert plan_time(timed(plan)) == plan_time(plan)


# Limits of bases are shared so that they are kept, and by no more than they are.


@settings(max_examples=100)
@given(st.integers(1, 4), st.integers(1, 6), st.integers(0, 10_000))
def test_shares_keep_all_bounds_and_none_could_grow(rows, count, seed):
    generator = np.random.default_rng(seed)
    levers = generator.uniform(0.2, 2.0, (rows, count)) * (generator.random((rows, count)) < 0.7)
    bounds = np.where(generator.random(rows) < 0.8, generator.uniform(0.1, 3.0, rows), np.inf)
    caps = np.where(generator.random(count) < 0.5, generator.uniform(0.1, 3.0, count), np.inf)
    shares = fill(levers, bounds, caps, generator.uniform(0.1, 2.0, count))
    finite = np.isfinite(bounds)
    free = ~((levers[finite] > 0.0).any(axis=0) | np.isfinite(caps))
    assert (np.isinf(shares) == free).all()
    known = np.where(free, 0.0, shares)
    used = levers[finite] @ known
    assert (used <= bounds[finite] * (1.0 + 1e-9)).all()
    assert (known[~free] <= caps[~free]).all()
    full = used >= bounds[finite] * (1.0 - 1e-6)
    held = (levers[finite][full] > 0.0).any(axis=0) | (known >= caps * (1.0 - 1e-6))
    assert held[~free].all()


def test_shares_are_in_proportion_to_needs_until_one_is_held():
    levers, caps = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0]]), np.array([np.inf, 0.5, np.inf])
    shares = fill(levers, np.array([2.0, 6.0]), caps, np.array([1.0, 1.0, 2.0]))
    assert shares == pytest.approx([1.5, 0.5, 4.5])
