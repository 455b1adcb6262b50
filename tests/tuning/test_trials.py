"""Trials of gains: the compiled loop in place of Drake's where it knows the team, with the same criteria."""

from dataclasses import replace
from functools import cache

import pytest

from coop_drake.laws import ScheduledGains
from coop_drake.scenario import Control, Deployment
from coop_drake.tuning import CRITERIA, TrialRunner
from tests.support.small_loop import small_maps, small_problem

OTHER = ScheduledGains(age_phase=0.3)


@cache
def simulated(rate):
    """Drake's trials of the usual and of other gains."""
    return [runner(rate).simulate(gains) for gains in (ScheduledGains(), OTHER)]


def runner(rate=None, control=None, **options):
    scenario, plan = small_problem()
    wanted = replace(scenario, deployment=Deployment(control_rate=rate), control=control or Control())
    return TrialRunner(wanted, plan, small_maps(), **options)


@pytest.mark.parametrize(("rate", "close"), [(200.0, 2e-3), (None, 0.2)], ids=["sampled", "continuous"])
def test_the_compiled_loop_measures_trials_as_drakes_loop_does(rate, close):
    trials = runner(rate)
    for expected in simulated(rate):
        found = trials.estimate(expected.gains)
        assert (found.loop, found.outcome.arrived) == ("compiled", True)
        # A sampled team says that it has arrived by a mean over a tenth of a second.
        assert found.outcome.values["time"] == pytest.approx(expected.outcome.values["time"], abs=0.1)
        for name in CRITERIA:
            assert found.outcome.values[name] == pytest.approx(expected.outcome.values[name], rel=close), name


def test_runs_that_last_too_long_have_failed():
    trials = runner(longest=2.0 * simulated(None)[0].outcome.values["time"])
    slow = trials.estimate(ScheduledGains(ramp_fraction=0.01, max_log_gain=1e-3, log_acceleration=0.02))
    assert slow.loop == "compiled"
    assert not slow.outcome.arrived
    assert slow.outcome.fraction_done < 1.0


def test_drakes_loop_runs_what_the_compiled_one_does_not_know():
    trial = runner(control=Control(observer=True)).estimate(OTHER)
    assert trial.loop == "drake"
