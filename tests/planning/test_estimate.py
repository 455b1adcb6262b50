"""Estimated times against the rule and against a transport carried out."""

import numpy as np
import pytest
from shapely import box

from coop_drake.control import FixedGains, ScheduledGains, transition_gains
from coop_drake.geometry import BoundaryDistance
from coop_drake.planning import make_plan, plan_time
from coop_drake.planning.estimate import speed_per_clearance, transition_time, travel_time
from tests.support.channels import bent_channel
from tests.support.governor_run import run_governor
from tests.support.point_mass import build_fields, carry_out


def test_a_transition_takes_settling_and_travel():
    assert transition_time(3.0, 0.1) == pytest.approx(10.6)
    assert travel_time(0.0, 0.1) == 0.0


@pytest.mark.parametrize("gain_set", [FixedGains(), ScheduledGains()])
def test_speed_in_a_long_aisle_is_that_of_a_governed_point(gain_set):
    half_width = 0.15
    aisle = box(0.0, -half_width, 30.0, half_width)
    lower, upper = np.array([-1.0]), np.array([1.0])
    gains = transition_gains(
        gain_set, neck=half_width, slice_lower=lower, slice_upper=upper, goal_lower=lower, goal_upper=upper,
        resting=np.zeros(1),
    )  # fmt: skip
    run = run_governor(
        BoundaryDistance(aisle), lambda point: np.array([1.0, 0.0]), position=np.array([2.0, 0.0]),
        velocity=np.zeros(2), governor=np.array([2.0, 0.0]), seconds=8.0, tolerance=1e-8,
        gains=(gains.stiffness, gains.damping, gains.governor_gain, 0.0),
    )  # fmt: skip
    assert run.velocity[-1, 0] == pytest.approx(speed_per_clearance(gains) * half_width, rel=1e-3)


def test_the_estimate_is_within_a_factor_of_two_of_a_transport_through_maps():
    plan = make_plan(*bent_channel(cells=4), ScheduledGains(), gain_set_name="scheduled")
    transport = carry_out(plan, build_fields(plan))
    assert transport.stuck is None
    assert transport.least_energy_margin > 0.0
    assert 0.5 < plan_time(plan) / float(np.sum(transport.durations)) < 2.0
