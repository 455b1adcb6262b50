"""Drake's loop with one block for a sampled team agrees with that of named blocks, row by row."""

from dataclasses import fields, replace

import numpy as np
import pytest

from coop_drake.answers.log import SimulationLog
from coop_drake.compiled_loop import prepare
from coop_drake.scenario import (
    ActuatorLimits,
    BlockedWheels,
    Deployment,
    Floor,
    JointFriction,
    Measurements,
    Messages,
    PoseBias,
    Push,
    RobotDepartures,
    Silence,
    StartOffset,
    Wave,
    Waves,
    WheelSlip,
)
from coop_drake.simulation import build_maps, simulate
from tests.support.sampled_block import build_sampled_loop, simulate_sampled
from tests.support.small_loop import small_maps, small_problem
from tests.support.system_checks import port_sizes
from tests.support.tubes import WITH_AXES, tubed_problem

EVERYTHING = Deployment(
    control_rate=200.0,
    mass_error=0.1,
    measurements=Measurements(1e-3, 5e-4, 1e-2, 0.008, loss=0.1, late=0.2, late_by=0.012,
                              waves=Waves(x=Wave(2e-3, 0.3), joints=Wave(1e-3, 0.5))),
    actuators=ActuatorLimits(base_force=60.0, lag=0.005),
    messages=Messages(loss=0.3, repeat=0.3, delay=0.01),
    robots={
        "robot_0": RobotDepartures(pose_bias=PoseBias(0.002, -0.001, 0.001), odometry_scale=0.05,
                                   clock_error=0.02, switch_delay=0.01, slip=WheelSlip(0.1, 0.3, 0.1)),
        "robot_1": RobotDepartures(silence=Silence(0.3, 0.02, motors="held"),
                                   blocked=BlockedWheels(0.45, 0.02)),
    },
    floor=Floor(coulomb_friction=2.0, viscous_friction=2.0, slope=0.01),
    joint_friction=JointFriction(coulomb=0.2, viscous=0.1),
    pushes=(Push("robot_1", (15.0, 5.0), 0.2, 0.2, torque=1.0),),
    seed=3,
)  # fmt: skip
NO_DELAY = Deployment(
    control_rate=100.0,
    measurements=Measurements(1e-3, 5e-4, 1e-2, loss=0.2, late=0.2, late_by=0.012),
    robots={"robot_1": RobotDepartures(silence=Silence(0.3, 0.02, motors="limp"))},
    start_offset=StartOffset(1e-3, -1e-3, 1e-3, (-1e-3, 1e-3)),
)
PRESET = Deployment(
    control_rate=200.0,
    mass_error=0.2,
    measurements=Measurements(0.001, 0.0005, 0.01, 0.01),
    actuators=ActuatorLimits(base_force=300.0, lag=0.005),
    messages=Messages(loss=0.2),
)


def both(scenario, plan, maps):
    """The logs of one block and of named blocks."""
    return simulate_sampled(prepare(scenario, plan, maps)), simulate(scenario, plan, maps)


def assert_same(found, expected):
    """Every number of the logs agrees to 1e-12 of the largest one of its kind, or of 1."""
    assert (found.reached, found.violation) == (expected.reached, expected.violation)
    assert len(expected.times) > 50
    forces = max(1.0, float(np.abs(expected.base_wrenches).max()))
    for field in fields(SimulationLog):
        numbers = getattr(expected, field.name)
        if isinstance(numbers, np.ndarray):
            scale = max(1.0, float(np.abs(numbers).max(initial=0.0)))
            if field.name in ("measured_wrenches", "wrench_error", "acceleration_error", "accelerations"):
                scale = forces
            np.testing.assert_allclose(
                getattr(found, field.name), numbers, rtol=0.0, atol=1e-12 * scale, err_msg=field.name
            )


@pytest.mark.slow
@pytest.mark.parametrize("deployment", [EVERYTHING, NO_DELAY], ids=["everything", "no delay"])
def test_all_departures_have_the_same_effect_in_every_row(deployment):
    scenario, plan = small_problem("base")
    brief = replace(scenario.simulator, max_time=0.6)
    assert_same(*both(replace(scenario, deployment=deployment, simulator=brief), plan, small_maps()))


@pytest.mark.slow
@pytest.mark.parametrize("team", ["base", "elbow"])
def test_a_run_with_a_budget_is_the_same_from_start_to_goal(team):
    scenario, plan = tubed_problem(WITH_AXES, team)
    found, expected = both(replace(scenario, deployment=PRESET), plan, build_maps(plan))
    assert expected.reached
    assert_same(found, expected)


def test_rows_between_samples_agree_too():
    scenario, plan = small_problem("base")
    short = replace(scenario.simulator, max_time=0.3, max_step_size=0.003)
    found, expected = both(replace(scenario, deployment=EVERYTHING, simulator=short), plan, small_maps())
    assert np.any(np.abs(np.diff(expected.times) - 0.005) > 1e-3)
    assert_same(found, expected)


def test_ports_of_the_block():
    scenario, plan = small_problem("base")
    transport = prepare(replace(scenario, deployment=PRESET), plan, small_maps())
    loop = build_sampled_loop(transport)
    inputs, outputs = port_sizes(loop.controllers)
    assert inputs == {"team_state": 2 * (3 + 2)}
    assert outputs == {"efforts": 3 * 2 + 2, "telemetry": 3 + 20 * 2 + 2 * 4}
    loop.release()
