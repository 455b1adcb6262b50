"""Base carries the budget of a usual team, three standard deviations of its noise being bounds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.sampled_plan import random_departures, run_axes, worst_departures
from coop_drake.answers import Found
from coop_drake.answers.budget import Budget
from coop_drake.cli.task import read_task
from coop_drake.planning.planner import plan
from coop_drake.shipped import scenario_file

MOBILE_BASE = Budget(
    control_rate=200.0, delay=0.01, lag=0.005, angle_noise=0.0015, rate_noise=0.03, model_error=0.2,
    acceleration_error=0.2, report_age=0.025,
)  # fmt: skip
"""The numbers of the preset, with three standard deviations of its noise."""


@pytest.fixture(scope="module")
def base():
    task = read_task(scenario_file(Path("base")))
    gain_set = task.scenario.gain_sets["scheduled"]
    answer = plan(task.problem, gain_set, gain_set_name="scheduled", budget=MOBILE_BASE)
    assert isinstance(answer, Found)
    return answer.plan


def stated(plan, name):
    return np.array([getattr(transition.tolerance, name) for transition in plan.transitions])


@pytest.mark.slow
@pytest.mark.parametrize(("departures", "count"), [(random_departures, 60), (worst_departures, 12)])
def test_departures_within_the_budget_never_take_an_axis_farther_than_stated(base, departures, count):
    runs = [run_axes(base, MOBILE_BASE, departures(base, MOBILE_BASE, seed)) for seed in range(count)]
    assert min(run.nearest for run in runs) >= stated(base, "distance").min() > 0.0
    assert (np.max([run.farthest for run in runs], axis=0) <= stated(base, "departure")).all()


def test_the_worst_departures_use_more_than_half_of_what_is_stated(base):
    runs = [run_axes(base, MOBILE_BASE, worst_departures(base, MOBILE_BASE, seed)) for seed in range(4)]
    shares = np.max([run.farthest for run in runs], axis=0) / stated(base, "departure")
    assert shares.max(axis=0).min() > 0.5


def test_departures_two_and_a_half_times_as_large_lose_an_axis(base):
    larger = MOBILE_BASE.scaled(2.5)
    larger = replace(larger, delay=MOBILE_BASE.delay, lag=MOBILE_BASE.lag, report_age=MOBILE_BASE.report_age)
    runs = [run_axes(base, larger, worst_departures(base, larger, seed)) for seed in range(2)]
    assert min(run.nearest for run in runs) < 0.0


def test_cells_are_left_at_rest(base):
    rests = [transition.gains.rest for transition in base.transitions]
    assert all((rest.rate > 0.0).all() and (rest.reach > 0.0).all() for rest in rests)
