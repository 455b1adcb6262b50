"""The picture of a search for gains: the best score is drawn from the first run that keeps all limits on."""

from __future__ import annotations

import numpy as np
import pytest

from coop_drake.laws import ScheduledGains
from coop_drake.tuning import CRITERIA, GainTrial, Limit, Objective, Search, TrialOutcome
from coop_drake.viz.tuning_figure import tuning_figure

BEFORE = dict.fromkeys(CRITERIA, 1.0) | {"time": 20.0, "peak_force": 200.0}


def trial(time, force, *, arrived=True):
    values = BEFORE | {"time": time, "peak_force": force} if arrived else {}
    return GainTrial(ScheduledGains(), TrialOutcome(arrived, float(arrived), values, ""))


@pytest.fixture
def found():
    objective = Objective({"peak_force": 1.0}, (Limit("time", at_most=True, value=15.0),), BEFORE)
    search = Search(objective)
    for one in (trial(20.0, 200.0), trial(0.0, 0.0, arrived=False), trial(14.0, 150.0), trial(14.0, 180.0)):
        search.add(one)
    return search


def test_the_best_score_falls_from_the_first_run_within_all_limits(found):
    _, fall = tuning_figure(found).axes
    (line,) = fall.lines
    np.testing.assert_allclose(line.get_xydata(), [(2.0, 0.75), (3.0, 0.75)])


def test_what_breaks_a_limit_and_what_is_chosen_are_distinguished(found):
    plane, _ = tuning_figure(found).axes
    drawn = {line.get_label(): line.get_xydata().tolist() for line in plane.lines if len(line.get_xdata())}
    assert drawn["breaks a limit"] == [[20.0, 200.0]]
    assert drawn["keeps all limits"] == [[14.0, 150.0], [14.0, 180.0]]
    assert drawn["chosen"] == [[14.0, 150.0]]
