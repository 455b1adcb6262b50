"""A team farther from its nominal motion than its plan states is held, brakes, or fails and says why."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.one_process import simulate_apart
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
from coop_drake.simulation import build_maps, simulate
from tests.support.sampled_block import simulate_sampled
from tests.support.tubes import WITH_AXES, tubed_problem

pytestmark = pytest.mark.slow

PRESET = Deployment(
    control_rate=200.0,
    mass_error=0.2,
    measurements=Measurements(0.001, 0.0005, 0.01, 0.01),
    actuators=ActuatorLimits(base_force=300.0, lag=0.005),
    messages=Messages(loss=0.2),
)
PUSHED = replace(PRESET, pushes=(Push("object", (90.0, 0.0), 0.5, 0.1),))
BLOCKED = replace(PRESET, robots={"robot_0": RobotDepartures(blocked=BlockedWheels(begin=0.5))})
BIASED = replace(PRESET, robots={"robot_1": RobotDepartures(pose_bias=PoseBias(x=0.04))})


@cache
def transport():
    scenario, plan = tubed_problem(replace(WITH_AXES, grasp_noise=0.017, turn_noise=0.006), "base")
    return prepare(replace(scenario, deployment=PRESET), plan, build_maps(plan))


def simulated(deployment, by=simulate):
    known = transport()
    return by(replace(known.scenario, deployment=deployment), known.plan, build_maps(known.plan))


def test_within_the_budget_nothing_comes_near_a_level_and_nobody_is_held():
    outcomes = [run(transport(), PRESET, seed=seed) for seed in range(20)]
    assert all(outcome.arrived for outcome in outcomes)
    assert 0.1 < max(outcome.alarm_share for outcome in outcomes) < 0.8
    log = simulated(PRESET)
    assert log.reached
    assert not log.held.any()


def test_a_push_that_ends_holds_the_team_which_then_goes_on():
    outcome, log = run(transport(), PUSHED), simulated(PUSHED)
    assert not outcome.arrived
    assert "asks for a hold" in outcome.reason
    assert outcome.alarm_share > 1.0
    first = log.times[np.argmax(log.held > 0.0)]
    assert outcome.time <= first <= outcome.time + 0.06  # requests may be lost five times in a row
    assert log.reached, log.violation
    assert log.clock_lag.max() > 0.1
    ready = log.ready_margins.min(axis=1)
    assert (ready[(log.times >= outcome.time) & (log.times < outcome.time + 0.1)] < 0.0).all()


@pytest.mark.parametrize("departing", [BLOCKED, BIASED], ids=["blocked", "biased"])
def test_what_goes_on_never_ends_in_an_arrival(departing):
    outcome, log = run(transport(), departing), simulated(departing)
    assert not outcome.arrived
    assert "robot_" in outcome.reason
    assert "as far as its level allows" in outcome.reason
    assert not log.reached
    assert log.held.any()
    assert "as far as its level allows" in log.violation
    one_block = simulate_sampled(transport(), departing)
    assert one_block.violation.split(": ")[2] == outcome.reason.split(": ")[2]
    assert abs(one_block.times[-1] - outcome.time) < 0.006


def test_robots_in_nodes_of_their_own_let_the_drives_brake():
    log = simulated(BLOCKED, simulate_apart)
    assert not log.reached
    assert "lets the drives brake" in log.violation
    assert log.held.any()
    quiet = simulated(PRESET, simulate_apart)
    assert quiet.reached
    assert not quiet.held.any()
