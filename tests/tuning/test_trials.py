"""Trials of gains: the compiled loop in place of Drake's where it knows the team, with the same criteria."""

from dataclasses import replace
from functools import cache

import pytest

from coop_drake.laws import ScheduledGains
from coop_drake.scenario import Control, Deployment
from coop_drake.tuning import CRITERIA, TrialRunner
from tests.support.small_loop import small_maps, small_problem

LONGEST = 60.0
OTHER = ScheduledGains(age_phase=0.3)


@cache
def simulated(rate):
    """Drake's trials of the usual and of other gains."""
    return [runner(rate).simulate(gains) for gains in (ScheduledGains(), OTHER)]


def runner(rate=None, **control):
    scenario, plan = small_problem()
    wanted = replace(scenario, deployment=Deployment(control_rate=rate), control=Control(**control))
    return TrialRunner(wanted, plan, small_maps())


@pytest.mark.parametrize(("rate", "close"), [(200.0, 2e-3), (None, 0.1)], ids=["sampled", "continuous"])
def test_the_compiled_loop_ranks_gains_as_drakes_loop_does(rate, close):
    (before, other), trials = simulated(rate), runner(rate)
    trials.compare(before, LONGEST)
    same, found = trials.estimate(before.gains), trials.estimate(OTHER)
    assert same.loop == found.loop == "compiled"
    assert same.outcome.values == pytest.approx(before.outcome.values)
    assert found.outcome.arrived
    for name in CRITERIA:
        assert found.outcome.values[name] == pytest.approx(other.outcome.values[name], rel=close), name


def test_runs_that_last_too_long_have_failed():
    (before, _), trials = simulated(None), runner()
    trials.compare(before, 2.0 * before.outcome.values["time"])
    slow = trials.estimate(ScheduledGains(ramp_fraction=0.01, max_log_gain=1e-3, log_acceleration=0.02))
    assert slow.loop == "compiled"
    assert not slow.outcome.arrived
    assert slow.outcome.fraction_done < 1.0


def test_drakes_loop_runs_what_the_compiled_one_does_not_know():
    (before, _), trials = simulated(None), runner(observer=True)
    trials.compare(before, LONGEST)
    assert trials.estimate(before.gains).loop == "drake"
