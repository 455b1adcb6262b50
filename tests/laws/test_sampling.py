"""Delays in control periods."""

from __future__ import annotations

import numpy as np
import pytest

from coop_drake.answers.budget import AxisTracking, Budget
from coop_drake.laws.measurements import whole_periods
from coop_drake.robustness.axis_departure import axis_loop
from coop_drake.scenario import Deployment, Measurements


@pytest.mark.parametrize(("time", "periods"), [(0.0, 0), (0.015, 3), (0.3, 60), (0.0151, 4), (0.001, 1)])
def test_a_time_is_rounded_up_to_whole_periods(time, periods):
    assert whole_periods(time, 0.005) == periods


def test_a_budget_and_the_gains_count_a_delay_as_the_simulation_does():
    barely_more = 0.01 * (1.0 + 1e-7)  # The simulation delays by a third period.
    assert whole_periods(barely_more, 0.005) == 3
    deployment = Deployment(control_rate=200.0, measurements=Measurements(delay=barely_more))
    assert deployment.whole_delay == pytest.approx(0.015)
    loops = [axis_loop(AxisTracking(300.0, 30.0), Budget(delay=delay)) for delay in (barely_more, 0.015)]
    np.testing.assert_array_equal(*(loop.sums for loop in loops))
