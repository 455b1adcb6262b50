"""Estimated times against the rule and against a transport carried out."""

import numpy as np
import pytest

from coop_drake.control import ScheduledGains
from coop_drake.planning import make_plan, plan_time
from coop_drake.planning.estimate import transition_time, travel_time
from tests.support.channels import bent_channel
from tests.support.point_mass import build_fields, carry_out


def test_a_transition_takes_settling_and_travel():
    assert transition_time(3.0, 0.1) == pytest.approx(10.6)
    assert travel_time(0.0, 0.1) == 0.0


def test_the_estimate_is_within_a_factor_of_two_of_a_transport_through_maps():
    plan = make_plan(*bent_channel(cells=4), ScheduledGains(), gain_set_name="scheduled")
    transport = carry_out(plan, build_fields(plan))
    assert transport.stuck is None
    assert transport.least_energy_margin > 0.0
    assert 0.5 < plan_time(plan) / float(np.sum(transport.durations)) < 2.0
