"""The slow way on which a cell is begun anew: from rest to rest, within its bounds, in the stated time."""

import numpy as np
import pytest

from coop_drake.laws.actuators import ACCELERATION, RATE, USED, closed_after, slow_motion, slow_samples
from coop_drake.laws.axis_table import DECAY_RATE, FADING_TIME, LAW_COLUMNS, RAMP_RATE, bounds_of


@pytest.mark.parametrize("share", [1.0, 0.25])
@pytest.mark.parametrize("distance", [1e-4, 0.05, 0.4, 3.0])
def test_the_way_keeps_to_its_bounds_and_ends_at_rest(distance, share):
    T = 0.005
    samples = slow_samples(distance, T, share)
    ends = np.array([[1.0, 0.2], [1.0 - distance, 0.2]])
    motions = [slow_motion(ends, k * T, samples * T) for k in range(samples + 1)]
    x, v, a = (np.array(part) for part in zip(*motions, strict=True))
    assert (x[0], x[-1]) == (pytest.approx(ends[0]), pytest.approx(ends[1]))
    assert np.abs([v[0], v[-1], a[0], a[-1]]).max() < 1e-12
    assert np.abs(v).max() <= USED * share * RATE
    assert np.abs(a).max() <= USED * share * ACCELERATION
    assert np.gradient(x[:, 0], T)[1:-1] == pytest.approx(v[1:-1, 0], abs=2e-3 * USED * RATE)
    assert (x[:, 1] == 0.2).all()


def test_before_and_after_it_nothing_moves():
    for time in (-1.0, 7.0):
        x, v, a = slow_motion(np.array([[0.0], [1.0]]), time, 3.0)
        assert (x[0], v[0], a[0]) == (float(time > 0.0), 0.0, 0.0)


def test_funnels_are_closed_gains_ramped_and_jumps_faded_when_the_law_takes_over():
    table = np.ones((2, LAW_COLUMNS))
    table[:, :4] = [-0.3, 0.3, -0.05, 0.05]
    table[:, DECAY_RATE], table[:, RAMP_RATE], table[:, FADING_TIME] = [10.0, 5.0], [2.0, 0.0], 0.4
    time = closed_after(table)
    assert time == pytest.approx(3.0)
    for row in table:
        assert bounds_of(row, time)[:4] == pytest.approx((-0.05, 0.05, 0.0, 0.0))
