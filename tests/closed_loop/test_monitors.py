"""A team farther from its motion than its plan states is held, brakes, or fails and says why."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from coop_drake.compiled_loop import prepare, run
from coop_drake.scenario import (
    ActuatorLimits,
    BlockedWheels,
    Deployment,
    Measurements,
    Messages,
    PoseBias,
    Push,
    RobotDepartures,
)
from coop_drake.simulation import simulate
from tests.support.motions import motion_under_budget
from tests.support.small_loop import small_maps

pytestmark = pytest.mark.slow

PRESET = Deployment(
    control_rate=200.0,
    mass_error=0.2,
    measurements=Measurements(0.001, 0.0005, 0.01, 0.01),
    actuators=ActuatorLimits(base_force=300.0, lag=0.005),
    messages=Messages(loss=0.2),
)
PUSHED = replace(PRESET, pushes=(Push("object", (130.0, 0.0), 0.2, 0.1),))
BLOCKED = replace(PRESET, robots={"robot_0": RobotDepartures(blocked=BlockedWheels(begin=0.5))})
BIASED = replace(PRESET, robots={"robot_1": RobotDepartures(pose_bias=PoseBias(x=0.04))})


@cache
def transport():
    scenario, plan = motion_under_budget()
    return prepare(replace(scenario, deployment=PRESET), plan, small_maps())


def simulated(deployment):
    known = transport()
    return simulate(replace(known.scenario, deployment=deployment), known.plan, small_maps())


def test_within_the_budget_nothing_comes_near_a_level_and_nobody_is_held():
    outcomes = [run(transport(), PRESET, seed=seed) for seed in range(20)]
    assert all(outcome.arrived for outcome in outcomes)
    assert 0.1 < max(outcome.alarm_share for outcome in outcomes) < 0.8
    log = simulated(PRESET)
    assert log.reached
    assert not log.held.any()


def test_a_push_that_ends_holds_the_team_which_then_goes_on():
    """It comes to rest on its motion, starts again and arrives, in both loops."""
    outcome, log = run(transport(), PUSHED), simulated(PUSHED)
    assert outcome.arrived, outcome.reason
    assert 1.0 < outcome.alarm_share < 2.0
    assert outcome.held == 1
    assert log.reached, log.violation
    assert log.times[-1] == pytest.approx(outcome.time)
    moves = (log.phases[:, :, 1] > 0.0).any(axis=1)
    assert np.count_nonzero(moves[1:] & ~moves[:-1]) == 2


@pytest.mark.parametrize("departing", [BLOCKED, BIASED], ids=["blocked", "biased"])
def test_what_goes_on_never_ends_in_an_arrival(departing):
    outcome, log = run(transport(), departing), simulated(departing)
    assert not outcome.arrived
    assert "robot_" in outcome.reason
    assert "as far as its level allows" in outcome.reason
    assert not log.reached
    assert log.held.any()
    assert "as far as its level allows" in log.violation
    assert abs(log.times[-1] - outcome.time) < 0.006
