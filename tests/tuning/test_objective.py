"""What is sought: criteria read from runs, weights and limits, and one number for each run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.errors import TuningError
from coop_drake.tuning import CRITERIA, Limit, Objective, TrialOutcome, read_weights
from coop_drake.tuning.objective import outcome_of
from tests.support.cases import case
from tests.support.synthetic_log import SECONDS, synthetic_log

BEFORE = {"time": 20.0, "peak_force": 100.0, "clearance": 0.1}


def outcome(*, arrived=True, fraction_done=1.0, **values):
    return TrialOutcome(arrived, fraction_done, {**BEFORE, **values}, "" if arrived else "stalled")


def test_criteria_are_read_from_the_run():
    log = synthetic_log(case("base"))
    pushes = np.zeros_like(log.base_wrenches)
    pushes[10, 1] = [-3.0, 4.0, -7.0]
    torques = np.zeros_like(log.joint_torques)
    torques[20, 0] = -2.5
    log = replace(log, base_wrenches=pushes, joint_torques=torques)
    values = outcome_of(log, 5).values
    assert set(values) == set(CRITERIA)
    assert values["time"] == SECONDS
    assert values["peak_force"] == pytest.approx(5.0)
    assert values["peak_base_torque"] == 7.0
    assert values["peak_torque"] == 2.5
    assert 0.0 < values["mean_force"] < 5.0
    assert values["clearance"] == log.workspace_clearance.min()


def test_a_constant_force_is_its_own_mean_however_steps_are_spread():
    log = synthetic_log(case("base"))
    constant = np.zeros_like(log.base_wrenches)
    constant[..., 0] = 6.0
    uneven = SECONDS * np.linspace(0.0, 1.0, len(log.times)) ** 3
    values = outcome_of(replace(log, base_wrenches=constant, times=uneven), 5).values
    assert values["mean_force"] == pytest.approx(6.0)


def test_a_run_that_broke_off_counts_the_cells_it_passed():
    log = synthetic_log(case("base"))
    broken = outcome_of(replace(log, violation="a wall"), 5)
    assert not broken.arrived
    assert broken.fraction_done == pytest.approx(0.8)


def test_the_run_before_scores_one_and_weights_are_shares():
    objective = Objective({"peak_force": 3.0, "clearance": 1.0}, (), BEFORE)
    assert objective.score(outcome()) == pytest.approx(1.0)
    assert objective.score(outcome(peak_force=50.0)) == pytest.approx((3.0 * 0.5 + 1.0) / 4.0)
    assert objective.score(outcome(clearance=0.2)) == pytest.approx((3.0 + 0.5) / 4.0)


def test_failed_runs_are_worse_than_broken_limits_and_those_than_any_that_keeps_them():
    objective = Objective(
        {"peak_force": 1.0}, (Limit.parse("time<=1.1x"), Limit.parse("clearance>=0.05")), BEFORE
    )
    ranked = [
        outcome(peak_force=50.0, time=22.0),
        outcome(peak_force=5000.0, time=19.0),
        outcome(peak_force=10.0, time=22.1),
        outcome(peak_force=10.0, time=22.1, clearance=0.01),
        outcome(arrived=False, fraction_done=0.9),
        outcome(arrived=False, fraction_done=0.2, peak_force=1.0),
    ]
    scores = [objective.score(one) for one in ranked]
    assert scores == sorted(scores)
    assert len(set(scores)) == len(scores)
    assert [objective.kept(one) for one in ranked] == [True, True, False, False, False, False]


def test_limits_are_read():
    assert Limit.parse("time<=16") == Limit("time", True, 16.0)
    assert Limit.parse(" clearance >= 0.1 ") == Limit("clearance", False, 0.1)
    assert Limit.parse("time<=1.1x").bound(BEFORE) == pytest.approx(22.0)


@pytest.mark.parametrize("text", ["time", "time<16", "speed<=1", "time<=..", "time<=1e", "time<=1y", ""])
def test_other_limits_are_refused_by_name(text):
    with pytest.raises(TuningError, match="--limit"):
        Limit.parse(text)


def test_weights_are_read_and_others_refused():
    assert read_weights(("peak_force", "time=0.5")) == {"peak_force": 1.0, "time": 0.5}
    for text in ("speed", "time=0", "time=-1", "time=nan", "time=inf", "time=x"):
        with pytest.raises(TuningError, match="--criterion"):
            read_weights((text,))
