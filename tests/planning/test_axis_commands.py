"""Bounds of the commands of axes hold for every law, noise and error of the model, by both computations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coop_drake.answers.budget import Budget
from coop_drake.laws.nominal_axes import lag_factors
from coop_drake.robustness.axis_departure import (
    at_rest,
    best_loop,
    departing,
    largest_commands,
    nothing_commanded,
)
from coop_drake.robustness.nominal_axes import ACCELERATION, COLUMNS, COMMAND, COMMAND_REACH, AxisSets
from coop_drake.verification.budgets import efforts
from coop_drake.verification.budgets.axis_departure import departures, loop_of, resting

BUDGET = Budget(delay=0.01, lag=0.005, angle_noise=0.0015, rate_noise=0.03, model_error=0.2, axis_error=0.35)
PERIODS, LEAVING = 120, 100
LOOP = best_loop(BUDGET, weight=0.002)
NOTHING = np.zeros((1, 1, 1))


def bounds(middle, reach, last):
    """The bounds of the planner and of the verifier, of every period, the last for ever."""
    tube = np.zeros((PERIODS, COLUMNS))
    tube[:, ACCELERATION] = np.abs(middle).max() + reach
    tube[:, COMMAND], tube[:, COMMAND_REACH] = middle, reach
    sets = AxisSets((tube,), 0.0, tube[0, ACCELERATION], last, 0.0, 0.0)
    laws = sets.commands(PERIODS).T[:, :, None]
    moving = sets.moving(PERIODS, BUDGET.period).T[:, :, None]
    found, _ = departing(LOOP, [sets], NOTHING, at_rest(LOOP, 1), LEAVING)
    before = nothing_commanded(LOOP, 1)
    own = laws.transpose(1, 0, 2), moving[:, 0], found.entered.T
    planned, _ = largest_commands(LOOP, *own, before, LEAVING)
    other = loop_of(LOOP.tracking, BUDGET)
    _, _, flows = departures(other, NOTHING, moving, resting(other, 1), LEAVING)
    given_before = efforts.nothing_given(other, 1)
    checked, _ = efforts.commanded(other, laws, moving, flows, given_before, LEAVING)
    return planned[:, 0], checked.accelerations[:, 0]


def commands(law, error, noise, push):
    """(1 + epsilon) (L + q) of an axis that begins at rest, in every period.

    Its departure obeys e'' = (1 + epsilon) (lagging q) + epsilon (lagging L) + push.
    """
    T, (left, in_v, in_x) = BUDGET.period, lag_factors(BUDGET.period, BUDGET.lag)
    stiffness, damping = LOOP.tracking.stiffness, LOOP.tracking.damping
    e, v, acting, found = [0.0] * 3, [0.0] * 3, 0.0, []
    for own, one, pushed in zip(law, noise, push, strict=True):
        q = -stiffness * (e[-3] + one[0]) - damping * (v[-3] + one[1])
        found.append((1.0 + error) * (own + q))
        u = (1.0 + error) * q + error * own
        gap = acting - u
        e.append(e[-1] + T * v[-1] + 0.5 * T * T * (u + pushed) + in_x * gap)
        v.append(v[-1] + T * (u + pushed) + in_v * gap)
        acting = u + left * gap
    return np.array(found)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-0.2, 0.2), st.floats(0.0, 3.0))
def test_no_command_is_larger_than_the_bounds(seed, error, reach):
    random = np.random.default_rng(seed)
    middle = 10.0 * np.sin(np.arange(PERIODS) * random.uniform(0.0, 0.3) + random.uniform(0.0, 6.0))
    last = 0.5
    planned, checked = bounds(middle, reach, last)
    signs = random.choice([-1.0, 1.0], size=(4, PERIODS + 300))
    signs[3] = np.where(random.uniform() < 0.5, signs[3], signs[3, 0])
    law = np.concatenate([middle, np.zeros(300)]) + signs[0] * np.repeat([reach, last], [PERIODS, 300])
    noise = np.column_stack([BUDGET.angle_noise * signs[1], BUDGET.rate_noise * signs[2]])
    found = np.abs(commands(law, error, noise, BUDGET.axis_error * signs[3]))
    for bound in (planned, checked):
        assert (found[:PERIODS] <= bound[:-1] + 1e-9).all()
        assert found[PERIODS:].max() <= bound[-1] + 1e-9


def test_what_wrong_masses_add_to_a_constant_command_the_pull_takes_off():
    """The command for a steady law is hardly more than the one that the true masses need, 10 rad/s^2."""
    planned, checked = bounds(np.full(PERIODS, 10.0), 0.0, 0.5)
    quiet = bounds(np.zeros(PERIODS), 0.0, 0.5)[0]
    steady = slice(80, 100)
    assert checked[steady] == pytest.approx(planned[steady], rel=1e-3)
    assert (planned[steady] - quiet[steady] < 11.8).all()
    assert (planned[steady] - quiet[steady] > 10.0).all()


def test_noise_that_is_the_worst_reaches_most_of_the_bound():
    """All errors have the signs of their responses in the last period."""
    planned, _ = bounds(np.zeros(PERIODS), 0.0, 0.0)
    error, zeros, quiet = 0.2, np.zeros(PERIODS), np.zeros((PERIODS, 2))
    answers = []
    for kind in range(2):
        for k in range(PERIODS):
            one = quiet.copy()
            one[k, kind] = 1.0
            answers.append(commands(zeros, error, one, zeros)[-1])
    noise = np.sign(np.reshape(answers, (2, PERIODS)).T) * [BUDGET.angle_noise, BUDGET.rate_noise]
    reached = abs(commands(zeros, error, noise, zeros)[-1])
    assert 0.7 * planned[-2] < reached < planned[-2]
