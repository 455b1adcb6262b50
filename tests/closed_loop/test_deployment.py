"""Every departure from the ideal team: a mild one, with which it still arrives, and one that breaks it."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import ExtractSimulatorConfig, Simulator
from pydrake.systems.primitives import ConstantVectorSource

from coop_drake.compiled_loop import prepare
from coop_drake.compiled_loop import run as compiled_run
from coop_drake.laws import FixedGains, ScheduledGains
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
from coop_drake.simulation import configure_simulator, simulate
from coop_drake.typed_data import convert_class
from tests.support.hand_over import assert_certified
from tests.support.run_checks import verified_run
from tests.support.small_loop import small_maps, small_problem

RATE = 100.0
RUNS = {}


def at_200_hz(**departures):
    return Deployment(control_rate=200.0, **departures)


def in_one(**departures):
    """Departures of one robot of two."""
    return at_200_hz(robots={"robot_0": RobotDepartures(**departures)})


def pushed(force):
    return at_200_hz(pushes=(Push("object", (force, 0.0), time=0.5, duration=0.5),))


MILD = {
    "sampling": Deployment(control_rate=RATE),
    "sampling, quicker": Deployment(control_rate=200.0),
    "saturation": Deployment(actuators=ActuatorLimits(base_force=50.0)),
    "lag": Deployment(control_rate=200.0, actuators=ActuatorLimits(lag=0.005)),
    "noise": Deployment(control_rate=RATE, measurements=Measurements(1e-3, 5e-4, 1e-3)),
    "waves": at_200_hz(measurements=Measurements(waves=Waves(angle=Wave(1e-3, 0.3), turn_rate=Wave(5e-3)))),
    "delay": Deployment(control_rate=200.0, measurements=Measurements(delay=0.005)),
    "model error": Deployment(mass_error=0.5),
    "lost reports": Deployment(control_rate=RATE, messages=Messages(loss=0.7)),
    "late reports": Deployment(control_rate=RATE, messages=Messages(delay=0.2)),
    "repeated reports": Deployment(control_rate=RATE, messages=Messages(repeat=1.0, delay=0.05)),
    "lost measurements": at_200_hz(measurements=Measurements(loss=0.1)),
    "late measurements": at_200_hz(measurements=Measurements(late=0.2, late_by=0.02)),
    "a biased pose in one robot": in_one(pose_bias=PoseBias(x=0.005)),
    "a biased pose in all": at_200_hz(robots={"*": RobotDepartures(pose_bias=PoseBias(x=0.005))}),
    "odometry": in_one(odometry_scale=0.05),
    "a late sample": in_one(sample_offset=0.0045),
    "a clock": in_one(clock_error=0.05),
    "a late switch": in_one(switch_delay=0.05),
    "silence": in_one(silence=Silence(0.5, 0.5)),
    "blocked wheels": in_one(blocked=BlockedWheels(0.5, 0.02)),
    "wheels that slip": in_one(slip=WheelSlip(0.5, 0.5, 0.2)),
    "friction": at_200_hz(floor=Floor(coulomb_friction=20.0, viscous_friction=5.0)),
    "friction of joints": at_200_hz(joint_friction=JointFriction(coulomb=0.3, viscous=0.2)),
    "slope": at_200_hz(floor=Floor(slope=0.01)),
    "push": pushed(20.0),
    "start": at_200_hz(start_offset=StartOffset(0.005, -0.005, 0.005, (0.005, -0.005))),
}
QUICK = {"sampling", "noise", "delay", "model error", "push"}
"""Departures that are no slow tests."""

HARSH = {
    "sampling": (Deployment(control_rate=15.0), "to its funnel is"),
    "start": (Deployment(start_offset=StartOffset(theta=0.3)), "distance of object angle to its funnel is -"),
    "saturation": (
        Deployment(actuators=ActuatorLimits(base_force=3.0)),
        "to its slice is -0.0",
    ),
    "saturation, sampled": (
        Deployment(control_rate=RATE, actuators=ActuatorLimits(base_force=10.0)),
        "to its funnel is",
    ),
    "lag": (Deployment(actuators=ActuatorLimits(lag=0.1)), "to its funnel is"),
    "noise": (
        Deployment(control_rate=RATE, measurements=Measurements(0.03, 0.015, 0.03)),
        "to its funnel is",
    ),
    "waves": (
        at_200_hz(measurements=Measurements(waves=Waves(joints=Wave(0.1, 0.3)))),
        "come to rest (margin",
    ),
    "delay": (Deployment(control_rate=RATE, measurements=Measurements(delay=0.1)), "to its funnel is"),
    "model error": (Deployment(mass_error=-0.98), "distance of object angle to its funnel is -"),
    "lost reports": (
        Deployment(control_rate=RATE, messages=Messages(loss=1.0)),
        "waits until the cell planner receives the robots' reports",
    ),
    "late reports": (
        Deployment(control_rate=RATE, messages=Messages(delay=5.0)),
        "waits until the cell planner receives the robots' reports",
    ),
    "lost measurements": (at_200_hz(measurements=Measurements(loss=0.98)), "to its funnel is"),
    "late measurements": (at_200_hz(measurements=Measurements(late=1.0, late_by=0.1)), "to its funnel is"),
    "a biased pose in one robot": (
        in_one(pose_bias=PoseBias(x=0.05)),
        "waits until the object reaches its goal position",
    ),
    "a biased pose in all": (
        at_200_hz(robots={"*": RobotDepartures(pose_bias=PoseBias(x=0.02))}),
        "the team says that it has arrived, but is 2.15 times the tolerance off the goal",
    ),
    "odometry": (in_one(odometry_scale=9.0), "to its funnel is"),
    "a clock": (in_one(clock_error=0.5), "to its funnel is"),
    "a late switch": (in_one(switch_delay=0.3), "to its funnel is"),
    "silence": (in_one(silence=Silence(0.5, None, "limp")), "to its funnel is"),
    "blocked wheels": (in_one(blocked=BlockedWheels(0.5)), "to its funnel is"),
    "wheels that slip": (in_one(slip=WheelSlip(0.5, 1.0)), "to its funnel is"),
    "friction": (
        at_200_hz(floor=Floor(coulomb_friction=50.0)),
        "waits until the object reaches its goal position",
    ),
    "friction of joints": (
        at_200_hz(joint_friction=JointFriction(coulomb=20.0)),
        "waits until the energy of",
    ),
    "slope": (at_200_hz(floor=Floor(slope=0.1)), "waits until the object reaches its goal position"),
    "push": (pushed(300.0), "to its funnel is"),
}


def run(deployment, gain_set=None, max_time=6.0):
    key = repr((deployment, gain_set, max_time))
    if key not in RUNS:
        RUNS[key] = run_anew(deployment, gain_set, max_time)
    return RUNS[key]


def deployed(deployment, gain_set=None, max_time=6.0):
    scenario, plan = small_problem("base", gain_set)
    simulator = replace(scenario.simulator, max_time=max_time)
    return replace(scenario, deployment=deployment, simulator=simulator), plan


def run_anew(deployment, gain_set=None, max_time=6.0):
    return simulate(*deployed(deployment, gain_set, max_time), small_maps())


@pytest.mark.no_cover
@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in MILD]
)
def test_a_mild_departure_is_survived(name):
    log = run(MILD[name])
    assert log.violation == ""
    assert log.reached
    assert min(log.workspace_clearance.min(), log.body_clearance.min(), log.cell_clearance.min()) > 0.0
    assert min(log.funnel_margin.min(), log.slice_margin.min()) > 0.0
    assert log.acceleration_error.max() > 1e-3  # it does depart
    assert log.energy_margin.min() >= 0.0
    assert_certified(small_problem("base")[1], log)
    assert verified_run(*deployed(MILD[name]), log).answer == "arrived"


def test_a_thousand_samples_a_second_are_survived_too():
    scenario, plan = small_problem("base")
    fast = replace(scenario, deployment=Deployment(control_rate=1000.0))
    outcome = compiled_run(prepare(fast, plan, small_maps()))
    assert outcome.arrived, outcome.reason
    assert min(outcome.funnel_margin, outcome.cell_margin) > 0.0


@pytest.mark.parametrize(("seed", "mass_error"), [(0, 0.2), (1, -0.2), (2, 0.2)])
def test_a_team_as_the_preset_describes_it_arrives(seed, mass_error):
    preset = convert_class({"preset": "mobile_base", "mass_error": mass_error, "seed": seed}, Deployment)
    log = run(preset, ScheduledGains().for_age(preset.command_age))
    assert log.violation == ""
    assert log.reached


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("name", HARSH)
def test_a_harsh_one_is_reported_as_what_it_is(name):
    deployment, complaint = HARSH[name]
    log = run(deployment, max_time=3.0 if deployment.messages == Messages() else 1.0)
    assert not log.reached
    assert complaint in log.violation


@pytest.mark.parametrize(("rate", "scheme"), [(None, "runge_kutta5"), (RATE, "bogacki_shampine3")])
def test_held_efforts_are_integrated_in_few_stages(rate, scheme):
    """Trial steps of a lost run stay finite: what is infinite after many stages would end the process."""
    scenario, _ = small_problem("base")
    simulator, deployment = Simulator(ConstantVectorSource([0.0])), Deployment(control_rate=rate)
    settings = replace(scenario.simulator, integration_scheme="runge_kutta5")
    configure_simulator(simulator, replace(scenario, deployment=deployment, simulator=settings))
    assert ExtractSimulatorConfig(simulator).integration_scheme == scheme


def test_the_paper_s_gains_do_not_survive_sampling_that_the_scheduled_ones_do():
    assert run(Deployment(control_rate=RATE)).reached
    assert "to its funnel is" in run(Deployment(control_rate=RATE), FixedGains()).violation


def test_a_fast_rate_comes_close_to_continuous_time():
    """Until the first switch, which continuous time looks for at every step and not at every period."""
    ideal, *sampled = (run(Deployment(control_rate=rate), max_time=0.35) for rate in (None, 100.0, 400.0))
    errors = []
    for log in sampled:
        poses = [np.interp(ideal.times, log.times, log.object_pose[:, axis]) for axis in range(3)]
        errors.append(np.abs(np.transpose(poses) - ideal.object_pose).max())
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.005


def test_a_seed_makes_a_run_again_to_the_last_bit():
    deployment = Deployment(control_rate=RATE, measurements=Measurements(1e-3, 1e-3, 1e-3), seed=4)
    first, other = run(deployment, max_time=0.3), run(replace(deployment, seed=5), max_time=0.3)
    again = run_anew(deployment, max_time=0.3)
    np.testing.assert_array_equal(first.object_pose, again.object_pose)
    assert np.any(first.object_pose != other.object_pose)
