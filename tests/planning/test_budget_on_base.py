"""Base carries the budget of a usual team: no random disturbance within it makes an axis leave its funnel."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.sampled_plan import carry_axes
from coop_drake.answers import Found
from coop_drake.answers.budget import Budget
from coop_drake.cli.task import read_task
from coop_drake.planning.planner import plan
from coop_drake.shipped import scenario_file

MOBILE_BASE = Budget(
    control_rate=200.0, delay=0.01, lag=0.005, angle_noise=0.0005, rate_noise=0.01, model_error=0.2,
    acceleration_error=0.2, report_age=0.025,
)  # fmt: skip
"""The numbers of the preset, as bounds."""


@pytest.fixture(scope="module")
def base():
    task = read_task(scenario_file(Path("base")))
    gain_set = task.scenario.gain_sets["scheduled"]
    answer = plan(task.problem, gain_set, gain_set_name="scheduled", budget=MOBILE_BASE)
    assert isinstance(answer, Found)
    return answer.plan


def test_disturbances_within_the_budget_never_take_an_axis_nearer_to_a_bound_than_stated(base):
    stated = min(float(transition.tolerance.distance.min()) for transition in base.transitions)
    distances = np.array([carry_axes(base, MOBILE_BASE, seed) for seed in range(300)])
    assert distances.min() >= stated > 0.0


def test_disturbances_three_times_as_large_do(base):
    assert min(carry_axes(base, MOBILE_BASE.scaled(3.0), seed) for seed in range(5)) < 0.0


def test_cells_are_left_at_rest_and_some_only_when_the_axes_have_settled(base):
    rests = [transition.gains.rest for transition in base.transitions]
    times = [transition.gains.hand_over_time for transition in base.transitions]
    waiting = [rest.after > time for rest, time in zip(rests, times, strict=True)]
    assert any(waiting)
    assert not all(waiting)
    assert max(rest.after for rest in rests) < 1.0
