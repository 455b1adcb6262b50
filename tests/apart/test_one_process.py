"""A team whose parts exchange plain values alone: the run is the one of the closed loop, bit for bit."""

from dataclasses import replace

import pytest

from benchmarks.one_process import simulate_apart
from coop_drake.diagram import control_period
from coop_drake.errors import ScenarioError
from coop_drake.scenario import Control, Deployment, Hold, Measurements, Messages, RobotDepartures, Silence
from coop_drake.scenario.deployment import ActuatorLimits, Deafness
from coop_drake.simulation import simulate
from tests.support.same_runs import differences
from tests.support.small_loop import small_maps, small_problem

USUAL = Deployment(
    control_rate=200.0,
    mass_error=0.2,
    measurements=Measurements(1e-3, 5e-4, 1e-3, delay=0.01, loss=0.1, late=0.1, late_by=0.01),
    actuators=ActuatorLimits(base_force=300.0, lag=0.005),
    messages=Messages(loss=0.2, repeat=0.2, delay=0.01),
)
SINGLE = Deployment(
    control_rate=100.0,
    robots={
        "robot_0": RobotDepartures(
            clock_error=0.005, silence=Silence(0.5, 0.02, "held"), odometry_scale=0.01
        ),
        "robot_1": RobotDepartures(switch_delay=0.01, deaf=Deafness(0.2, 0.3)),
    },
)
HELD = Control(hold=Hold(at=(0.3,), duration=0.5, silence=0.1, energy=8.0))
CASES = {
    "base, sampled": ("base", Deployment(control_rate=100.0), Control()),
    "elbow, usual departures": ("elbow", USUAL, Control(predictor=True, observer=True)),
    "three, usual departures, held": ("three", USUAL, HELD),
    "base, single robots depart, held": ("base", SINGLE, HELD),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_the_log_is_that_of_the_closed_loop(case):
    team, deployment, control = CASES[case]
    scenario, plan = small_problem(team)
    scenario = replace(scenario, deployment=deployment, control=control)
    together = simulate(scenario, plan, small_maps())
    apart = simulate_apart(scenario, plan, small_maps())
    assert together.reached
    assert differences(together, apart) == []


@pytest.mark.parametrize(
    ("deployment", "key"),
    [
        (Deployment(), "deployment.control_rate"),
        (
            Deployment(control_rate=100.0, robots={"robot_0": RobotDepartures(sample_offset=0.001)}),
            "sample_offset",
        ),
    ],
)
def test_robots_apart_compute_at_common_samples(deployment, key):
    scenario, _ = small_problem("base")
    with pytest.raises(ScenarioError, match=key):
        control_period(replace(scenario, deployment=deployment))
