"""Every departure from the ideal team: which is survived, what a harsh one ends in, no false arrival."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.systems.analysis import ExtractSimulatorConfig, Simulator
from pydrake.systems.primitives import ConstantVectorSource

from coop_drake.compiled_loop import prepare
from coop_drake.compiled_loop import run as compiled_run
from coop_drake.compiled_loop.watching import left_by_all
from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.laws.words import ARRIVED
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
from tests.support.motions import motion_under_budget
from tests.support.run_checks import verified_run
from tests.support.small_loop import small_maps, small_problem
from tests.support.stepped import samples

RATE = 100.0
RUNS = {}


def sampled(rate=200.0, **departures):
    return Deployment(control_rate=rate, **departures)


def of_one(**departures):
    """Departures of one robot of two."""
    return sampled(robots={"robot_0": RobotDepartures(**departures)})


def pushed(force):
    return sampled(pushes=(Push("object", (force, 0.0), time=0.5, duration=0.5),))


MILD = {
    "motors and the floor": sampled(
        actuators=ActuatorLimits(lag=0.005),
        floor=Floor(coulomb_friction=10.0, viscous_friction=5.0, slope=0.003),
        joint_friction=JointFriction(coulomb=0.1, viscous=0.1),
        start_offset=StartOffset(0.002, -0.002, 0.002, (0.002, -0.002)),
    ),
    "sensors and messages": sampled(
        measurements=Measurements(
            loss=0.05, late=0.1, late_by=0.01, waves=Waves(angle=Wave(1e-3, 0.3), turn_rate=Wave(5e-3))
        ),
        messages=Messages(loss=0.5, repeat=0.5, delay=0.02),
    ),
    "one robot": of_one(
        pose_bias=PoseBias(x=0.003), odometry_scale=0.02, clock_error=0.02, switch_delay=0.02,
        silence=Silence(0.5, 0.1), blocked=BlockedWheels(0.5, 0.02), slip=WheelSlip(0.7, 0.3, 0.1),
    ),
}  # fmt: skip
"""Three mixtures of weak departures; single ones of every kind are in ``ARRIVING``."""


FUNNEL, GOAL = "to its funnel is", "waits until the object reaches its goal position"
REPORTS = "waits until the cell planner receives the robots' reports"

HARSH = {
    "sampling": (Deployment(control_rate=15.0), FUNNEL),
    "start": (Deployment(start_offset=StartOffset(theta=0.3)), "distance of object angle to its funnel is -"),
    "saturation": (Deployment(actuators=ActuatorLimits(base_force=3.0)), "to its slice is -0.0"),
    "saturation, sampled": (sampled(RATE, actuators=ActuatorLimits(base_force=10.0)), FUNNEL),
    "lag": (Deployment(actuators=ActuatorLimits(lag=0.1)), FUNNEL),
    "noise": (sampled(RATE, measurements=Measurements(0.03, 0.015, 0.03)), FUNNEL),
    "waves": (sampled(measurements=Measurements(waves=Waves(joints=Wave(0.1, 0.3)))), "come to rest (margin"),
    "delay": (sampled(RATE, measurements=Measurements(delay=0.1)), FUNNEL),
    "model error": (Deployment(mass_error=-0.98), "distance of object angle to its funnel is -"),
    "lost reports": (sampled(RATE, messages=Messages(loss=1.0)), REPORTS),
    "late reports": (sampled(RATE, messages=Messages(delay=5.0)), REPORTS),
    "lost measurements": (sampled(measurements=Measurements(loss=0.98)), FUNNEL),
    "late measurements": (sampled(measurements=Measurements(late=1.0, late_by=0.1)), FUNNEL),
    "a biased pose in one robot": (of_one(pose_bias=PoseBias(x=0.05)), GOAL),
    "a biased pose in all": (
        sampled(robots={"*": RobotDepartures(pose_bias=PoseBias(x=0.02))}),
        "the team says that it has arrived, but is 2.15 times the tolerance off the goal",
    ),
    "odometry": (of_one(odometry_scale=9.0), FUNNEL),
    "a clock": (of_one(clock_error=0.5), FUNNEL),
    "a late switch": (of_one(switch_delay=0.3), FUNNEL),
    "silence": (of_one(silence=Silence(0.5, None, "limp")), FUNNEL),
    "blocked wheels": (of_one(blocked=BlockedWheels(0.5)), FUNNEL),
    "wheels that slip": (of_one(slip=WheelSlip(0.5, 1.0)), FUNNEL),
    "friction": (sampled(floor=Floor(coulomb_friction=50.0)), GOAL),
    "friction of joints": (sampled(joint_friction=JointFriction(coulomb=20.0)), "waits until the energy of"),
    "slope": (sampled(floor=Floor(slope=0.1)), GOAL),
    "push": (pushed(300.0), FUNNEL),
}


COMPILED = {
    name
    for name, (deployment, complaint) in HARSH.items()
    if complaint == FUNNEL and deployment.control_rate is not None and name != "a clock"
}
"""Departures whose end the compiled loop shows, which ends lost runs where and why Drake's does."""


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


ARRIVING = {
    "rate": sampled(20.0),
    "saturation": sampled(actuators=ActuatorLimits(base_force=50.0)),
    "lag": sampled(actuators=ActuatorLimits(lag=0.02)),
    "masses believed too large": sampled(mass_error=0.5),
    "masses believed too small": sampled(mass_error=-0.5),
    "noise": sampled(measurements=Measurements(1e-3, 5e-4, 0.01)),
    "waves": sampled(
        measurements=Measurements(waves=Waves(angle=Wave(1.5e-3, 0.3), joints=Wave(1.5e-3, 0.3)))
    ),
    "delay": sampled(measurements=Measurements(delay=0.02)),
    "lost measurements": sampled(measurements=Measurements(loss=0.3)),
    "late measurements": sampled(measurements=Measurements(late=0.8, late_by=0.5)),
    "lost reports": sampled(messages=Messages(loss=0.7)),
    "late reports": sampled(messages=Messages(delay=0.2)),
    "repeated reports": sampled(messages=Messages(repeat=1.0, delay=0.05)),
    "a biased pose in one": of_one(pose_bias=PoseBias(x=0.005)),
    "a biased pose in all": sampled(robots={"*": RobotDepartures(pose_bias=PoseBias(x=0.005))}),
    "odometry": of_one(odometry_scale=0.05),
    "a clock": of_one(clock_error=0.05),
    "a late switch": of_one(switch_delay=0.05),
    "silence": of_one(silence=Silence(0.5, 2.0)),
    "blocked wheels": of_one(blocked=BlockedWheels(0.5, 0.02)),
    "wheels that slip": of_one(slip=WheelSlip(0.5, 0.5)),
    "friction": sampled(floor=Floor(coulomb_friction=20.0, viscous_friction=5.0)),
    "friction of joints": sampled(joint_friction=JointFriction(coulomb=0.3, viscous=0.2)),
    "slope": sampled(floor=Floor(slope=0.017)),
    "push": sampled(pushes=(Push("object", (20.0, 0.0), time=0.5, duration=2.0),)),
    "start": sampled(start_offset=StartOffset(0.005, -0.005, 0.005, (0.005, -0.005))),
}
"""The column "arrives" of docs/how_to/deployment.md, or more than it says, but for a rate of 15 Hz, at which
this room is lost."""


@pytest.mark.parametrize("name", ARRIVING)
def test_each_departure_alone_arrives_with_room_to_spare(name):
    outcome = compiled_run(ideal(), ARRIVING[name])
    assert outcome.arrived, outcome.reason
    assert min(outcome.funnel_margin, outcome.cell_margin) > 0.0
    assert min(outcome.wall_clearance, outcome.body_clearance) > 0.0
    assert repr(outcome) != repr(compiled_run(ideal()))  # it does depart


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("name", MILD)
def test_mild_departures_are_survived(name):
    log = run(MILD[name])
    assert log.violation == ""
    assert log.reached
    assert min(log.workspace_clearance.min(), log.body_clearance.min(), log.cell_clearance.min()) > 0.0
    assert min(log.funnel_margin.min(), log.slice_margin.min()) > 0.0
    assert log.acceleration_error.max() > 1e-3  # it does depart
    assert log.energy_margin.min() >= 0.0
    assert_certified(small_problem("base")[1], log)
    assert verified_run(*deployed(MILD[name]), log).answer == "arrived"


def test_the_compiled_loop_judges_every_joint_at_the_goal():
    scenario, plan = deployed(HARSH["waves"][0])
    outcome = compiled_run(prepare(scenario, plan, small_maps()))
    assert not outcome.arrived
    assert "max_time" in outcome.reason


@pytest.mark.parametrize(("seed", "mass_error"), [(0, 0.2), (1, -0.2), (2, 0.2)])
def test_a_team_as_the_preset_describes_it_arrives(seed, mass_error):
    preset = convert_class({"preset": "mobile_base", "mass_error": mass_error, "seed": seed}, Deployment)
    log = run(preset, ScheduledGains().for_age(preset.command_age))
    assert log.violation == ""
    assert log.reached


@pytest.mark.no_cover
@pytest.mark.parametrize(
    "name", [name if name in COMPILED else pytest.param(name, marks=pytest.mark.slow) for name in HARSH]
)
def test_a_harsh_one_is_reported_as_what_it_is(name):
    deployment, complaint = HARSH[name]
    most = 3.0 if deployment.messages == Messages() else 1.0
    if name in COMPILED:
        outcome = compiled_run(prepare(*deployed(deployment, max_time=most), small_maps()))
        arrived, reason = outcome.arrived, outcome.reason
    else:
        log = run(deployment, max_time=most)
        arrived, reason = log.reached, log.violation
    assert not arrived
    assert complaint in reason


@pytest.mark.parametrize(("rate", "scheme"), [(None, "runge_kutta5"), (RATE, "bogacki_shampine3")])
def test_held_efforts_are_integrated_in_few_stages(rate, scheme):
    """Trial steps of a lost run stay finite: what is infinite after many stages would end the process."""
    scenario, _ = small_problem("base")
    simulator, deployment = Simulator(ConstantVectorSource([0.0])), Deployment(control_rate=rate)
    settings = replace(scenario.simulator, integration_scheme="runge_kutta5")
    configure_simulator(simulator, replace(scenario, deployment=deployment, simulator=settings))
    assert ExtractSimulatorConfig(simulator).integration_scheme == scheme


def test_the_paper_s_gains_do_not_survive_sampling_that_the_scheduled_ones_do():
    assert run(sampled(RATE)).reached
    assert "to its funnel is" in run(sampled(RATE), FixedGains()).violation


def test_a_fast_rate_comes_close_to_continuous_time():
    """Until the first switch, which continuous time looks for at every step and not at every period."""
    ideal, *sampled = (run(Deployment(control_rate=rate), max_time=0.35) for rate in (None, 100.0, 400.0))
    errors = []
    for log in sampled:
        poses = [np.interp(ideal.times, log.times, log.object_pose[:, axis]) for axis in range(3)]
        errors.append(np.abs(np.transpose(poses) - ideal.object_pose).max())
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] < 0.005


SECONDS = 6.0
SIZES = (1.0, 3.0, 10.0)


DEPARTURES = {
    "sampling": lambda size: sampled(200.0 / (2.0 * size)),
    "limits": lambda size: sampled(actuators=ActuatorLimits(base_force=30.0 / size)),
    "lag": lambda size: sampled(actuators=ActuatorLimits(lag=0.01 * size)),
    "model error": lambda size: sampled(mass_error=0.5 * size),
    "masses believed too small": lambda size: sampled(mass_error=-0.3 * size if size < 3.0 else -0.9),
    "noise": lambda size: sampled(measurements=Measurements(2e-3 * size, 1e-3 * size, 1e-2 * size)),
    "bounded errors of angles": lambda size: sampled(
        measurements=Measurements(waves=Waves(angle=Wave(5e-3 * size, 0.3), joints=Wave(5e-3 * size, 0.3)))
    ),
    "delay": lambda size: sampled(measurements=Measurements(delay=0.01 * size)),
    "lost measurements": lambda size: sampled(measurements=Measurements(1e-3, loss=1.0 - 0.5 / size)),
    "late measurements": lambda size: sampled(measurements=Measurements(late=0.8, late_by=0.02 * size)),
    "lost reports": lambda size: sampled(messages=Messages(loss=1.0 - 0.3 / size)),
    "late reports": lambda size: sampled(messages=Messages(delay=0.2 * size)),
    "repeated reports": lambda size: sampled(messages=Messages(repeat=1.0, delay=0.05 * size)),
    "odometry": lambda size: of_one(odometry_scale=0.5 * size),
    "clock": lambda size: of_one(clock_error=0.05 * size),
    "late switches": lambda size: of_one(switch_delay=0.05 * size),
    "silence": lambda size: of_one(silence=Silence(0.3 * size)),
    "held motors": lambda size: of_one(silence=Silence(0.5, 0.1 * size, "held")),
    "limp motors": lambda size: of_one(silence=Silence(0.5, 0.1 * size, "limp")),
    "blocked wheels": lambda size: of_one(blocked=BlockedWheels(0.3 * size)),
    "wheels that slip": lambda size: of_one(slip=WheelSlip(0.5, 1.0 - 0.5 / size)),
    "Coulomb friction": lambda size: sampled(floor=Floor(coulomb_friction=20.0 * size)),
    "viscous friction": lambda size: sampled(floor=Floor(viscous_friction=50.0 * size)),
    "friction of joints": lambda size: sampled(joint_friction=JointFriction(1.0 * size, 0.5 * size)),
    "slope": lambda size: sampled(floor=Floor(slope=0.02 * size)),
    "push": lambda size: sampled(pushes=(Push("object", (50.0 * size, 20.0 * size), 1.0, 2.0),)),
    "start": lambda size: sampled(start_offset=StartOffset(0.02 * size, 0.0, 0.02 * size)),
}
"""Every line of docs/how_to/deployment.md but biases of the pose, by its size."""


@cache
def ideal():
    scenario, plan = small_problem("base")
    return prepare(replace(scenario, deployment=sampled()), plan, small_maps())


@cache
def budgeted():
    scenario, plan = motion_under_budget()
    return prepare(scenario, plan, small_maps())


def run_unwatched(transport, deployment):
    """Whether the supervisor says that the team has arrived, when, and z then, or after ``SECONDS``."""
    last = len(transport.plan.cells) - 1
    for time, memory in samples(transport, deployment):
        row = round(time / deployment.period) % len(memory.current)
        cell, z = int(memory.current[row, 0]), memory.state[transport.order]
        left = cell == last and left_by_all(cell, memory.channels)
        if left or memory.supervised[0] == ARRIVED:
            return True, time, z
        if time > SECONDS:
            break
    return False, time, z


def off(transport, z):
    """How far a configuration is from the goal, over what is tolerated, [-]."""
    goal, allowed = transport.plan.goal_pose, transport.scenario.goal.tolerances
    return max(np.hypot(*(z[:2] - goal[:2])) / allowed.position, abs(z[2] - goal[2]) / allowed.angle)


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("transport", [ideal, budgeted], ids=["no budget", "budget"])
@pytest.mark.parametrize("name", DEPARTURES)
def test_no_departure_ends_in_arrived_away_from_the_goal(name, transport):
    for size in SIZES:
        deployment = DEPARTURES[name](size)
        rate = transport().scenario.deployment.control_rate
        if transport is budgeted:
            if deployment.messages.delay >= 0.05:
                continue  # no run is allowed in which words are later than the plan states
            deployment = replace(deployment, control_rate=rate)
        for seed in range(2):
            arrived, _, z = run_unwatched(transport(), replace(deployment, seed=seed))
            assert not arrived or off(transport(), z) <= 1.0, (size, seed, z)


def test_the_same_runs_without_departures_arrive():
    for transport in (ideal(), budgeted()):
        arrived, time, z = run_unwatched(transport, transport.scenario.deployment)
        assert arrived
        assert off(transport, z) < 0.5
        assert compiled_run(transport).time == pytest.approx(time)


def test_biases_that_differ_by_more_than_twice_the_tolerance_are_noticed_and_others_the_world_shows():
    allowed = ideal().scenario.goal.tolerances.position
    apart = {
        f"robot_{k}": RobotDepartures(PoseBias(x=side * 1.05 * allowed)) for k, side in ((0, 1), (1, -1))
    }
    assert not run_unwatched(ideal(), sampled(robots=apart))[0]
    alike = sampled(robots={"*": RobotDepartures(PoseBias(x=1.5 * allowed))})
    arrived, time, z = run_unwatched(ideal(), alike)
    assert arrived
    assert 1.0 < off(ideal(), z) < 2.5
    outcome, said = compiled_run(ideal(), alike), "the team says that it has arrived"
    assert (outcome.arrived, outcome.time) == (False, pytest.approx(time))
    assert said in outcome.reason
    log = simulate(replace(ideal().scenario, deployment=alike), ideal().plan, small_maps())
    assert not log.reached
    assert said in log.violation
    assert log.times[-1] == pytest.approx(time)
