"""More effort gives plans that are no slower, the same effort the same plan, and no effort the first path."""

import json
from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers import Found
from coop_drake.answers.plan_file import plan_document
from coop_drake.errors import StallError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.channel import CoveredPath
from coop_drake.planning.duration import plan_time
from coop_drake.planning.planner import plan, quicker_plans
from coop_drake.planning.rescaling import Rescaling
from coop_drake.planning.search import find_path
from tests.planning.test_search import rod_problem
from tests.support.channels import bent_channel

REPEATED = 2.5
"""An effort that is no whole number: the last path has half of the usual work."""


@pytest.fixture(scope="module")
def problem():
    return rod_problem(0.6)


def asked(problem, effort=None, progress=None):
    result = plan(problem, ScheduledGains(), gain_set_name="scheduled", effort=effort, progress=progress)
    assert isinstance(result, Found)
    return result


def test_plans_are_no_slower_with_more_effort_and_repeat(problem):
    results = {effort: asked(problem, effort) for effort in (0.0, 1.0, REPEATED)}
    again = asked(replace(problem, settings=replace(problem.settings, effort=REPEATED)))
    assert json.dumps(plan_document(again.plan)) == json.dumps(plan_document(results[REPEATED].plan))
    assert plan_time(results[REPEATED].plan) <= plan_time(results[1.0].plan)
    for result in results.values():
        seconds, estimates = np.array(result.report.improvements).T
        assert (np.diff(seconds) > 0.0).all()
        assert (np.diff(estimates) < 0.0).all()
        assert estimates[-1] == pytest.approx(plan_time(result.plan))


@pytest.mark.parametrize("effort", [-0.1, float("nan"), float("inf")])
def test_efforts_without_meaning_are_refused(problem, effort):
    with pytest.raises(ValueError, match=r"allowed are numbers of 0 or more"):
        plan(problem, ScheduledGains(), gain_set_name="scheduled", effort=effort)


def test_only_quicker_plans_are_kept_and_shown():
    asked_for, told = [], []
    problem, _ = bent_channel(cells=3)
    made = asked(problem, 1.0).plan

    def lasting(seconds):
        first, *others = (replace(step, estimated_time=0.0) for step in made.transitions)
        return replace(made, transitions=(replace(first, estimated_time=seconds), *others))

    def another(number, share):
        asked_for.append((number, share))
        return CoveredPath(np.zeros((2, 3)), 0.0, bool, another) if number != 2 else None

    plans = iter([lasting(11.0), StallError("too narrow"), lasting(9.0)])

    def make(path):
        latest = next(plans)
        if isinstance(latest, Exception):
            raise latest
        return latest

    found = CoveredPath(np.zeros((2, 3)), 0.0, bool, another)
    quicker = quicker_plans(found, lasting(10.0), make, 4.5, lambda phase, fraction: told.append(phase))
    assert [plan_time(one) for one in quicker] == [9.0]
    assert asked_for == [(1, 1.0), (2, 1.0), (3, 1.0), (4, 0.5)]
    assert all("10.0 s so far" in phase for phase in told)


def test_a_team_twenty_times_as_large_has_further_paths_too(problem):
    large = Rescaling(problem, 0.05).question()
    found, _ = find_path(large)
    assert isinstance(found, CoveredPath)
    other = found.another(1, 1.0)
    assert other is not None
    assert np.allclose(other.path[0], large.start)
    assert np.allclose(other.path[-1, :2], large.goal_pose[:2])
    assert not np.array_equal(other.path, found.path)
