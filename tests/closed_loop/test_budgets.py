"""A team within its budget keeps, in Drake's loop, to what its plan states about departures."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from coop_drake.cli.summary import beyond_budget, budget_facts
from coop_drake.compiled_loop import prepare
from coop_drake.compiled_loop import run as run_compiled
from coop_drake.errors import RefusalError
from coop_drake.simulation import simulate
from coop_drake.verification.runs.budget import check_budget_used
from coop_drake.verification.runs.rows import Rows
from tests.support.motions import budgeted_motion, motion_under_budget
from tests.support.run_checks import verified_run
from tests.support.small_loop import small_maps


@cache
def run():
    scenario, plan = motion_under_budget()
    return scenario, plan, simulate(scenario, plan, small_maps())


def test_the_run_arrives_and_is_accepted_within_its_budget():
    scenario, plan, log = run()
    assert (log.reached, log.violation) == (True, "")
    assert not log.held.any()
    checks = {check.name: check for check in verified_run(scenario, plan, log).checks}
    for name in (
        "the object stayed as near to its motion as stated",
        "its velocity stayed as near to that of the motion",
        "axes stayed near their motion",
        "their rates stayed near those of the motion",
    ):
        assert 0.01 < checks[name].tightest < 1.0


def test_a_stated_departure_that_is_exceeded_in_the_world_is_said_and_its_log_refused():
    _, plan, log = run()
    within, stated = budget_facts(plan, log), plan.departures
    assert 0.01 < within["budget_used"] < 1.0
    assert beyond_budget(within) == ""
    row = len(log.times) // 2
    for array, column, away, what in (
        ("object_pose", 1, stated.position[0], "the object's position"),
        ("object_twist", 0, stated.rate[0], "the object's velocity"),
        ("joints", 0, stated.position[2], "robot_0::elbow"),
        ("joint_rates", 1, stated.rate[3], "the rate of robot_1::elbow"),
    ):
        moved = getattr(log, array).copy()
        moved[row, column] += 1.9 * away
        departed = replace(log, **{array: moved})
        said = beyond_budget(budget_facts(plan, departed))
        assert said.startswith((f"{what} departed by 1.", f"{what} departed by 2."))
        assert said.endswith(f"times what the plan's budget states, at t = {log.times[row]:.6g} s")
        assert beyond_budget(budget_facts(plan, departed, until=log.times[row])) == ""
        with pytest.raises(RefusalError, match="from the motion; the plan's budget states"):
            check_budget_used(Rows(departed, plan))


def test_phases_of_clocks_that_differ_are_those_of_two_milliseconds():
    _, _, log = run()
    assert 0.0 < np.ptp(log.phases[..., 0], axis=1).max() <= 0.004


@pytest.mark.parametrize("delay", [0.0, 0.005])
@pytest.mark.parametrize("seed", [1, 2])
def test_clocks_alone_are_within_a_budget_of_them_and_no_alarm(delay, seed):
    """Where nothing is noisy, levels are as small as they can be."""
    scenario, plan = budgeted_motion(
        {
            "control_rate": 200, "clock_error": 0.002, "budget": "all", "seed": seed,
            "measurements": {"delay": delay},
        }
    )  # fmt: skip
    outcome = run_compiled(prepare(scenario, plan, small_maps()), scenario.deployment)
    assert outcome.arrived, outcome.reason
    assert 0.0 < outcome.budget_share < 1.0
    assert 0.0 < outcome.alarm_share < 1.0
