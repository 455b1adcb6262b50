"""The tube of a nominal motion holds every motion that enters in its set; the settled set is never left."""

from itertools import product

import numpy as np
import pytest

from coop_drake.laws import Funnel, ScheduledGains, transition_gains
from coop_drake.laws.axis_table import FADING_TIME, axis_table, bounds_of, track_row
from coop_drake.laws.nominal import carry_axes
from coop_drake.laws.ppc import fading
from coop_drake.robustness.funnel_law import MEMORY, fit_law
from coop_drake.robustness.nominal_axes import (
    ACCELERATION,
    COLUMNS,
    DISTANCE,
    V_REACH,
    X_REACH,
    AxisConditions,
    Entry,
    V,
    X,
    _switching,
    axis_sets,
)


def axis(age=0.0175, slice_=(-0.1, 0.25), goal=(0.0, 0.12), resting=0.02):
    ends = [np.array([value]) for value in (*slice_, *goal)]
    gains = transition_gains(
        ScheduledGains(command_age=age), clearance=0.2, slice_lower=ends[0], slice_upper=ends[1],
        goal_lower=ends[2], goal_upper=ends[3], resting=np.array([resting]),
    )  # fmt: skip
    return axis_table(Funnel(*ends, gains.decay_rate, gains.funnel), gains)[0]


@pytest.mark.parametrize("reach", [1e-4, 0.01, 0.03])
def test_the_law_is_its_line_within_the_rest(reach):
    row, generator = axis(), np.random.default_rng(4)
    for time in (0.0, 0.3, 2.0):
        lower, upper = bounds_of(row, time)[:2]
        x, v = lower + 0.4 * (upper - lower), 0.2
        slope, by_rate, rest, spread = fit_law(row, time, x, reach, v, np.empty(MEMORY))
        middle = track_row(row, time, x, v)[0]
        for a, b in generator.uniform(-1.0, 1.0, (200, 2)) * [reach, 0.3]:
            change = track_row(row, time, x + a, v + b)[0] - middle
            assert abs(change - slope * a - by_rate * b) <= rest + spread * abs(b) + 1e-9


def moved(row, period, lag, start, first, jump, samples):
    """Nominal x and x' at every sample; the first command is that of the cell before."""
    state, states = np.array(start).reshape(3, 1), []
    for k in range(samples):
        states.append(state[:2, 0])
        command = track_row(row, k * period, *state[:2, 0])[0] + fading(k * period, row[FADING_TIME]) * jump
        following = np.empty((3, 1))
        carry_axes(state, np.array([command if k else first]), period, lag, following)
        state = following
    return np.array(states)


@pytest.mark.parametrize(("period", "lag"), [(0.005, 0.0), (0.005, 0.005), (0.01, 0.003)])
def test_no_motion_from_the_entry_set_leaves_the_tube(period, lag):
    row, entry = axis(), Entry(0.015, 0.025, -0.02, 0.02, 0.5)
    sets = axis_sets(row, AxisConditions(period, lag), entry, 1)
    (tube,) = sets.tubes
    assert 0.0 < sets.distance <= tube[:, DISTANCE].min()
    samples, jump = len(tube) + 200, -track_row(row, 0.0, 0.02, 0.0)[0]
    ends = (entry.lower, 0.02, entry.upper), (-0.02, 0.0, 0.02), (-0.5, 0.5), (-0.5, 0.5)
    for x, v, pushed, first in product(*ends):
        motion = moved(row, period, lag, (x, v, pushed if lag else 0.0), first, jump, samples)
        shown, later = motion[: len(tube)], motion[len(tube) :]
        assert (np.abs(shown[:, 0] - tube[:, X]) <= tube[:, X_REACH] + 1e-12).all()
        assert (np.abs(shown[:, 1] - tube[:, V]) <= tube[:, V_REACH] + 1e-12).all()
        assert (np.abs(later[:, 0] - 0.06) <= sets.settled + 1e-12).all()
        assert (np.abs(later[:, 1]) <= sets.settled_rate + 1e-12).all()


def test_motions_that_are_lost_are_not_certified():
    row = axis()
    for conditions, entry in (
        (AxisConditions(0.2, 0.0), Entry(0.02, 0.02)),
        (AxisConditions(0.005, 0.3), Entry(0.02, 0.02)),
        (AxisConditions(0.005, 0.0), Entry(-0.099, 0.02)),
        (AxisConditions(0.005, 0.0), Entry(0.02, 0.02, -3.0, 0.0)),
    ):
        assert not axis_sets(row, conditions, entry, 3).distance > 0.0


def test_a_larger_entry_set_leaves_less_distance():
    row, conditions = axis(), AxisConditions(0.005, 0.005)
    entries = [
        Entry(0.02 - x, 0.02 + x, -v, v, a)
        for x, v, a in ((0.0, 0.0, 0.0), (0.01, 0.02, 0.5), (0.02, 0.1, 3.0))
    ]
    distances = [axis_sets(row, conditions, entry, 1).distance for entry in entries]
    assert distances[0] > distances[1] > distances[2] > 0.0


@pytest.mark.parametrize("seed", range(20))
def test_a_tube_is_left_from_each_rest_on_for_the_time_for_which_a_report_of_it_may_be_used(seed):
    """Bounds are those of all samples at most so long after one at rest; pushes count since its report."""
    generator = np.random.default_rng(seed)
    tube, middle, since, leaving = generator.uniform(-1.0, 1.0, (40, COLUMNS)), 0.2, 3, 5
    tube[:, [X_REACH, V_REACH, ACCELERATION]] = generator.uniform(0.0, 0.1, (40, 3))
    reach, rate = 0.15, 0.3 if seed % 4 else 0.0
    at_rest = [
        k
        for k in range(leaving, 40)
        if abs(tube[k, X] - middle) <= reach + tube[k, X_REACH] and abs(tube[k, V]) <= rate + tube[k, V_REACH]
    ]
    left = sorted({k for first in at_rest for k in range(first, min(first + since + 1, 40))})
    pushed = sorted({i for k in left for i in range(max(k - since, leaving), k + 1)})
    low, high, slow, fast, now, since_report = _switching(tube, middle, (reach, rate), since, leaving)
    if not left:
        assert low > high
        return
    assert (low, high) == pytest.approx(
        ((tube[left, X] - tube[left, X_REACH]).min(), (tube[left, X] + tube[left, X_REACH]).max())
    )
    assert (slow, fast) == (
        (tube[left, V] - tube[left, V_REACH]).min(), (tube[left, V] + tube[left, V_REACH]).max()
    )  # fmt: skip
    assert (now, since_report) == (tube[left, ACCELERATION].max(), tube[pushed, ACCELERATION].max())
