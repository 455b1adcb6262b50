"""Departures of single robots and forces from outside, as they are wired into the loop."""

from dataclasses import replace
from itertools import pairwise
from math import sin

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.diagram import build_closed_loop, build_station
from coop_drake.errors import ScenarioError
from coop_drake.plant import set_configuration
from coop_drake.scenario import (
    Deployment,
    Floor,
    JointFriction,
    PlantSettings,
    PoseBias,
    Push,
    RobotDepartures,
    Silence,
)
from coop_drake.scenario.checks import validate
from coop_drake.simulation import configure_simulator
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_scenario import small_scenario

PERIOD = 0.01


def loop_of(**deployment):
    scenario, plan = small_problem("base")
    deployed = replace(scenario, deployment=Deployment(control_rate=1.0 / PERIOD, **deployment))
    return build_closed_loop(deployed, plan, small_maps())


def in_first(**departures):
    return {"robots": {"robot_0": RobotDepartures(**departures)}}


def inputs(loop, root, name):
    """What the controllers of both robots get, then what the loop gives them."""
    inside = [
        law.GetInputPort(name).Eval(law.GetMyContextFromRoot(root)).copy() for law in loop.bare_controllers
    ]
    outside = [
        part.GetInputPort(name).Eval(part.GetMyContextFromRoot(root)).copy() for part in loop.controllers
    ]
    return inside, outside


def efforts(loop, root):
    return [
        part.GetOutputPort("robot_effort").Eval(part.GetMyContextFromRoot(root)).copy()
        for part in loop.controllers
    ]


def test_a_bias_is_that_of_one_robot_or_of_all_others():
    bias, common = PoseBias(0.1, -0.2, 0.3), PoseBias(x=1.0)
    loop = loop_of(robots={"robot_0": RobotDepartures(bias), "*": RobotDepartures(common)})
    inside, outside = inputs(loop, loop.create_context(), "object_pose")
    np.testing.assert_allclose(inside[0] - outside[0], [0.1, -0.2, 0.3])
    np.testing.assert_allclose(inside[1] - outside[1], [1.0, 0.0, 0.0])


def test_odometry_scales_the_rates_of_the_base_alone():
    loop = loop_of(**in_first(odometry_scale=0.5))
    root, plant = loop.create_context(), loop.team.plant
    moving = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    set_configuration(loop.team, plant.GetMyMutableContextFromRoot(root), loop.plan.start, moving)
    inside, outside = inputs(loop, root, "robot_state")
    np.testing.assert_allclose(inside[0], outside[0] * [1, 1, 1, 1, 1.5, 1.5, 1.5, 1])
    np.testing.assert_array_equal(inside[1], outside[1])


def test_a_clock_that_is_ahead_takes_more_time_to_have_passed():
    loop = loop_of(**in_first(clock_error=0.25))
    inside, outside = inputs(loop, loop.create_context(), "current_cell")
    np.testing.assert_allclose(inside[0] - outside[0], [0.0, -0.25])
    np.testing.assert_array_equal(inside[1], outside[1])


def test_a_late_robot_hears_of_a_switch_later_than_the_others():
    loop = loop_of(**in_first(switch_delay=3 * PERIOD))
    simulator, cells = Simulator(loop.diagram, loop.create_context()), []
    for k in range(100):
        simulator.AdvanceTo(k * PERIOD - 1e-9 * bool(k))  # just before controllers compute
        inside, _ = inputs(loop, simulator.get_context(), "current_cell")
        cells.append([cell[0] for cell in inside])
    late, prompt = np.transpose(cells)
    assert prompt[-1] >= 1.0
    np.testing.assert_array_equal(late[3:], prompt[:-3])


def test_a_robot_that_samples_later_changes_its_effort_later():
    loop = loop_of(**in_first(sample_offset=0.004))
    simulator, given = Simulator(loop.diagram, loop.create_context()), []
    for time in (0.102, 0.106, 0.112):
        simulator.AdvanceTo(time)
        given.append(efforts(loop, simulator.get_context()))
    same = [[np.array_equal(a, b) for a, b in zip(*pair, strict=True)] for pair in pairwise(given)]
    assert same == [[False, True], [True, False]]


@pytest.mark.slow
@pytest.mark.parametrize("motors", ["working", "held", "limp"])
def test_a_silent_robot_sends_its_last_report_and_its_motors_do_as_stated(motors):
    loop = loop_of(**in_first(silence=Silence(0.3, 0.1, motors)))
    simulator, seen = Simulator(loop.diagram, loop.create_context()), []
    for time in (0.295, 0.305, 0.355, 0.395, 0.405):
        simulator.AdvanceTo(time)
        root = simulator.get_context()
        ready = loop.controllers[0].GetOutputPort("ready")
        report = ready.Eval(loop.controllers[0].GetMyContextFromRoot(root)).copy()
        seen.append((report, *efforts(loop, root)))
    reports, own, others = (np.array(values) for values in zip(*seen, strict=True))
    assert np.ptp(reports[1:4, 1]) == 0.0 < abs(reports[4, 1] - reports[3, 1])
    assert np.all(np.ptp(others, axis=0)[:2] > 0.0)
    if motors == "working":
        assert np.all(np.any(np.diff(own, axis=0) != 0.0, axis=1))
    else:
        np.testing.assert_array_equal(own[1:4], np.tile(own[1], (3, 1)))
        assert np.any(own[4] != own[3])
        assert np.any(own[1] != 0.0) == (motors == "held")


@pytest.mark.parametrize("grasps", ["joints", "constraints"])
def test_on_a_slope_a_team_without_effort_rolls_down_as_one(grasps):
    scenario = replace(
        small_scenario("base"),
        deployment=Deployment(floor=Floor(slope=0.1)),
        plant=PlantSettings(grasps=grasps),
    )
    found = object_acceleration(scenario)
    np.testing.assert_allclose(found, [9.80665 * sin(0.1), 0.0, 0.0], atol=1e-5)


@pytest.mark.parametrize("body", ["object", "robot_1"])
def test_a_push_moves_the_body_for_its_time(body):
    pushes = (Push(body, (3.0, 0.0), time=1.0, duration=0.5), Push(body, (0.0, 2.0), time=1.2, duration=0.5))
    scenario = replace(small_scenario("base"), deployment=Deployment(pushes=pushes))
    moved = np.array([object_acceleration(scenario, time) for time in (0.9, 1.1, 1.3, 1.6, 2.0)])
    mass = 17.0
    np.testing.assert_array_equal(moved[[0, 4]], 0.0)
    if body == "object":  # the joints give way a little: at least as quick as the whole team in one piece
        assert moved[1, 0] >= 3.0 / mass
    np.testing.assert_allclose(moved[2], moved[1] + moved[3], atol=1e-9)
    assert np.all(np.abs(moved[[1, 3]]).max(axis=1) > 1e-2)


def test_friction_brakes_a_moving_team():
    scenario = replace(small_scenario("base"), deployment=Deployment(floor=Floor(20.0, 1.0)))
    moving = np.array([0.5, 0.0, 0.0, 0.0, 0.0])
    assert object_acceleration(scenario, rates=moving)[0] == pytest.approx(-2 * 20.5 / 17.0, rel=0.2)
    np.testing.assert_array_equal(object_acceleration(scenario), 0.0)


def test_friction_of_joints_holds_them_at_rest_against_less_and_not_against_more():
    """A joint that moves comes to rest, and then stays where it is; it does not creep."""
    friction = Deployment(joint_friction=JointFriction(coulomb=0.5))
    scenario = replace(small_scenario("base"), deployment=friction)
    station = build_station(scenario)
    simulator = Simulator(station.diagram)
    configure_simulator(simulator, scenario)
    root, team = simulator.get_mutable_context(), station.team
    context, joints = team.plant.GetMyMutableContextFromRoot(root), team.velocity_index[3:]
    start, moving = np.array([3.0, 3.0, 0.2, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 0.1, -0.1])
    set_configuration(team, context, start, moving)
    efforts = [station.diagram.GetInputPort(f"robot_{k}_effort") for k in range(2)]
    held = [port.FixValue(root, np.array([0.0, 0.0, 0.0, 0.3])) for port in efforts]
    simulator.AdvanceTo(1.0)
    rested = team.plant.GetPositions(context).copy()
    assert (np.abs(team.plant.GetVelocities(context)[joints]) < 1e-9).all()
    simulator.AdvanceTo(2.0)
    away = np.abs(team.plant.GetPositions(context) - rested)[team.position_index[3:]]
    assert (away < 1e-9).all()
    for value in held:
        value.GetMutableData().set_value(np.array([0.0, 0.0, 0.0, 0.55]))
    simulator.AdvanceTo(2.5)
    rates = team.plant.GetVelocities(context)[joints]
    assert (rates > 1e-2).all()


def test_friction_of_joints_is_refused_where_it_cannot_be_simulated():
    scenario = replace(
        small_scenario("base"),
        deployment=Deployment(joint_friction=JointFriction(viscous=0.1)),
        plant=PlantSettings(grasps="constraints"),
    )
    with pytest.raises(ScenarioError) as refused:
        validate(scenario)
    assert refused.value.key == "deployment.joint_friction"


def object_acceleration(scenario, time=0.0, rates=None):
    """The object's acceleration without any effort of the robots, joints at zero."""
    station = build_station(scenario)
    root = station.diagram.CreateDefaultContext()
    root.SetTime(time)
    plant = station.team.plant
    z = np.array([3.0, 3.0, 0.2, 0.0, 0.0])
    set_configuration(station.team, plant.GetMyMutableContextFromRoot(root), z, rates)
    for k in range(2):
        station.diagram.GetInputPort(f"robot_{k}_effort").FixValue(root, np.zeros(4))
    found = station.diagram.GetOutputPort("generalized_acceleration").Eval(root)
    return found[station.team.velocity_index[:3]]
