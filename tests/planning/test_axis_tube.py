"""The tube of an axis holds every motion that its budget allows, and the settled set is never left."""

from math import ceil

import numpy as np
import pytest

from benchmarks.sampled_axis import attacks, push_towards, run_axis
from coop_drake.answers.budget import Budget
from coop_drake.laws import Funnel, ScheduledGains, transition_gains
from coop_drake.laws.axis_table import axis_table, bounds_of, track_row
from coop_drake.planning.budget.axis_sets import Entry, axis_sets, conditions_of
from coop_drake.planning.budget.axis_tube import DISTANCE, V_REACH, X_REACH, V, X
from coop_drake.planning.budget.law_fit import fit_law, law_memory

BUDGETS = {
    "sampled": Budget(acceleration_error=0.5),
    "old": Budget(delay=0.01, acceleration_error=0.3),
    "lagging": Budget(delay=0.005, lag=0.005, acceleration_error=0.3, angle_noise=1e-4),
    "noisy": Budget(angle_noise=5e-4, rate_noise=0.01),
    "wrong": Budget(delay=0.005, model_error=0.2),
    "all": Budget(
        delay=0.01, lag=0.005, angle_noise=3e-4, rate_noise=0.006, model_error=0.05, acceleration_error=0.15
    ),
}


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
        slope, by_rate, rest, spread = fit_law(row, time, x, reach, v, law_memory())
        middle = track_row(row, time, x, v)[0]
        for a, b in generator.uniform(-1.0, 1.0, (200, 2)) * [reach, 0.3]:
            change = track_row(row, time, x + a, v + b)[0] - middle
            assert abs(change - slope * a - by_rate * b) <= rest + spread * abs(b) + 1e-9


@pytest.mark.parametrize("name", BUDGETS)
def test_no_disturbance_within_the_budget_leaves_the_tube(name):
    budget, row = BUDGETS[name], axis()
    entry = Entry(0.015, 0.025, -0.02, 0.02, 0.5, 0.5)
    conditions = conditions_of(budget)
    sets = axis_sets(row, conditions, entry, 1)
    assert sets.distance > 0.0
    size = np.array([budget.angle_noise, budget.rate_noise, budget.acceleration_error])
    samples = len(sets.tubes[0]) + 200
    delay, generator = ceil(budget.delay / budget.period - 1e-6), np.random.default_rng(3)
    middle, jump = 0.06, -track_row(row, 0.0, 0.02, 0.0)[0]
    for seed, tube in enumerate(sets.tubes):
        for disturbances in attacks(row, budget.period, size, samples, seed):
            for x in (entry.lower, entry.upper):
                for sign in (-1.0, 1.0):
                    motion, shot = np.zeros((samples, 3)), int(generator.integers(10, samples))
                    factor = conditions[seed].model_factor + sign * conditions[seed].model_error
                    start = (x, sign * 0.02, sign * 0.5)
                    for _ in range(2):
                        kept = run_axis(
                            row, budget.period, delay, budget.lag, start, jump, disturbances, factor, 1,
                            motion,
                        )  # fmt: skip
                        assert kept
                        shown = motion[: len(tube)]
                        assert (np.abs(shown[:, 0] - tube[:, X]) <= tube[:, X_REACH] + 1e-9).all()
                        assert (np.abs(shown[:, 1] - tube[:, V]) <= tube[:, V_REACH] + 1e-9).all()
                        assert (np.abs(motion[len(tube) :, 0] - middle) <= sets.settled + 1e-9).all()
                        assert (np.abs(motion[len(tube) :, 1]) <= sets.settled_rate + 1e-9).all()
                        push_towards(
                            row, budget.period, delay, budget.lag, size, factor, 1, (shot, sign), motion,
                            disturbances,
                        )  # fmt: skip
    assert sets.distance <= min(tube[:, DISTANCE].min() for tube in sets.tubes)


def test_departures_that_lose_the_axis_are_not_certified():
    row, entry = axis(), Entry(0.02, 0.02)
    for departure in ({"delay": 0.1}, {"acceleration_error": 30.0}, {"angle_noise": 0.08}, {"lag": 0.3}):
        assert not axis_sets(row, conditions_of(Budget(**departure)), entry, 8).distance > 0.0


def test_more_of_a_departure_leaves_less_distance():
    row, entry = axis(), Entry(0.02, 0.02)
    distances = [
        axis_sets(row, conditions_of(BUDGETS["all"].scaled(factor)), entry, 1).distance
        for factor in (0.0, 0.5, 1.0)
    ]
    assert distances[0] > distances[1] > distances[2] > 0.0
