"""Bounds of departures and commands of axes hold for every law, noise and error of the model."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from coop_drake.answers.budget import Budget
from coop_drake.planning.budget.fitting import best_loop
from coop_drake.robustness.axis_departure import at_rest, departing, resting_axes
from coop_drake.robustness.efforts import largest_commands, nothing_commanded
from coop_drake.robustness.nominal_axes import ACCELERATION, COLUMNS, COMMAND, COMMAND_REACH, AxisSets

BUDGET = Budget(delay=0.01, lag=0.005, angle_noise=0.0015, rate_noise=0.03, model_error=0.2, axis_error=0.35)
PERIODS, LEAVING = 120, 100


@cache
def loop():
    return best_loop(BUDGET, weight=0.002)


def bounds(middle, reach, last):
    """Bounds of |e|, |e'| and of commands in every period, the last for ever, shape (3, periods + 1)."""
    tube = np.zeros((PERIODS, COLUMNS))
    tube[:, ACCELERATION] = np.abs(middle).max() + reach
    tube[:, COMMAND], tube[:, COMMAND_REACH] = middle, reach
    sets = AxisSets((tube,), 0.0, tube[0, ACCELERATION], last, 0.0, 0.0)
    laws = sets.commands(PERIODS)[:, :, None]
    moving = sets.moving(PERIODS, BUDGET.period).T[:, :, None]
    found, _ = departing(loop(), [sets], np.zeros((1, 1, 1)), at_rest(loop(), 1), LEAVING)
    own = laws, moving[:, 0], found.entered.T
    asked, _ = largest_commands(loop(), *own, nothing_commanded(loop(), 1), LEAVING)
    return np.array([found.position[:, 0], found.rate[:, 0], asked[:, 0]])


def flow():
    """The exact map over a period of (e, e', lagging acceleration), with the held command and push behind."""
    motion = np.zeros((5, 5))
    motion[0, 1] = motion[1, 2] = motion[1, 4] = 1.0
    motion[2, 2], motion[2, 3] = -1.0 / BUDGET.lag, 1.0 / BUDGET.lag
    return expm(BUDGET.period * motion)[:3]


FLOW = flow()


def run(law, error, noise, push, rates=(0.0, 0.0, 0.0)):
    """e, e' and (1 + epsilon) (L + q) of an axis in every period, shape (3, periods).

    Its departure obeys e'' = (1 + epsilon) (lagging q) + epsilon (lagging L) + push. It begins at rest, but
    for rates: in the two measurements before the beginning, and at the beginning.
    """
    stiffness, damping = loop().tracking.stiffness, loop().tracking.damping
    e, v, acting, asked = [0.0] * 3, list(rates), 0.0, []
    for own, one, pushed in zip(law, noise, push, strict=True):
        q = -stiffness * (e[-3] + one[0]) - damping * (v[-3] + one[1])
        asked.append((1.0 + error) * (own + q))
        state = np.array([e[-1], v[-1], acting, (1.0 + error) * q + error * own, pushed])
        after, rate, acting = FLOW @ state
        e.append(after)
        v.append(rate)
    return np.array([e[2:-1], v[2:-1], asked])


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-0.2, 0.2), st.floats(0.0, 3.0))
def test_nothing_is_larger_than_the_bounds(seed, error, reach):
    random = np.random.default_rng(seed)
    middle = 10.0 * np.sin(np.arange(PERIODS) * random.uniform(0.0, 0.3) + random.uniform(0.0, 6.0))
    last = 0.5
    most = bounds(middle, reach, last)
    signs = random.choice([-1.0, 1.0], size=(4, PERIODS + 300))
    signs[3] = np.where(random.uniform() < 0.5, signs[3], signs[3, 0])
    law = np.concatenate([middle, np.zeros(300)]) + signs[0] * np.repeat([reach, last], [PERIODS, 300])
    noise = np.column_stack([BUDGET.angle_noise * signs[1], BUDGET.rate_noise * signs[2]])
    found = np.abs(run(law, error, noise, BUDGET.axis_error * signs[3]))
    assert (found[:, :PERIODS] <= most[:, :-1] + 1e-9).all()
    assert (found[:, PERIODS:].max(axis=1) <= most[:, -1] + 1e-9).all()


def test_what_wrong_masses_add_to_a_constant_command_the_pull_takes_off():
    """The command for a steady law is hardly more than the one that the true masses need, 10 rad/s^2."""
    asked, quiet = (bounds(np.full(PERIODS, law), 0.0, 0.5)[2, 80:100] for law in (10.0, 0.0))
    assert (asked - quiet < 11.8).all()
    assert (asked - quiet > 10.0).all()


@pytest.mark.parametrize(("row", "share"), [(0, 0.8), (1, 0.6), (2, 0.7)])
def test_the_worst_noise_and_push_reach_most_of_the_bound(row, share):
    """All have the signs of their responses in the last period, which are those of an exact map."""
    most = bounds(np.zeros(PERIODS), 0.0, 0.0)[row, -2]
    error, zeros = 0.2, np.zeros(PERIODS)
    answers = []
    for kind in range(3):
        for k in range(PERIODS):
            one = np.zeros((3, PERIODS))
            one[kind, k] = 1.0
            answers.append(run(zeros, error, one[:2].T, one[2])[row, -1])
    sizes = np.array([[BUDGET.angle_noise], [BUDGET.rate_noise], [BUDGET.axis_error]])
    worst = sizes * np.sign(np.reshape(answers, (3, PERIODS)))
    reached = run(zeros, error, worst[:2].T, worst[2])[row, -1]
    assert share * most < reached < most


def test_an_axis_that_is_taken_for_resting_departs_by_no_more_than_its_rate_causes():
    rate, quiet = 0.02, np.zeros((400, 2))
    away, fast, push, pull = resting_axes(loop(), rate)
    for error in (-0.2, 0.0, 0.2):
        for signs in ((1.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (-1.0, -1.0, 1.0)):
            found = np.abs(run(quiet[:, 0], error, quiet, quiet[:, 0], rate * np.array(signs)))
            assert (found.max(axis=1) <= [away, fast, push]).all()
            assert found[0].max() > 0.3 * away
    assert pull < push
