"""What a deployment puts round the controllers and into the plant, and nothing where it is not asked for."""

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
    ActuatorLimits,
    Deployment,
    Floor,
    JointFriction,
    Measurements,
    PlantSettings,
    PoseBias,
    Push,
    RobotDepartures,
    Silence,
    StartOffset,
    Wave,
    Waves,
)
from coop_drake.scenario.checks import validate
from coop_drake.simulation import configure_simulator
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_scenario import small_scenario

NOISE = Measurements(position_noise=0.01, angle_noise=0.02, rate_noise=0.03)


def loop_of(**deployment):
    scenario, plan = small_problem("base")
    return build_closed_loop(replace(scenario, deployment=Deployment(**deployment)), plan, small_maps())


def outputs(parts, root, name):
    """An output of every part of a loop in the loop's context."""
    return [part.GetOutputPort(name).Eval(part.GetMyContextFromRoot(root)).copy() for part in parts]


def inputs(loop, root, name):
    """What the controllers of both robots get, then what the loop gives them."""
    return [
        [part.GetInputPort(name).Eval(part.GetMyContextFromRoot(root)).copy() for part in parts]
        for parts in (loop.bare_controllers, loop.controllers)
    ]


def parts(diagram):
    return {system.get_name() for system in diagram.GetSystems()}


def test_an_ideal_team_has_nothing_round_its_controllers():
    loop = loop_of(seed=3)
    assert loop.deployed == ()
    assert loop.bare_controllers == loop.controllers


def test_a_sampled_team_keeps_its_governors_between_samples():
    loop = loop_of(control_rate=200.0)
    root = loop.create_context()
    assert root.num_continuous_states() == 2 * (3 + len(loop.team.joints))
    for governor in outputs(loop.bare_controllers, root, "governor_position"):
        np.testing.assert_array_equal(governor, loop.plan.start[:2])


def test_a_team_may_stand_off_the_start_and_its_controllers_do_not_know():
    offset = StartOffset(0.01, -0.02, 0.03, (0.04, -0.05))
    loop, there = loop_of(start_offset=offset), loop_of()
    contexts = [one.create_context() for one in (loop, there)]
    states = [
        one.team.plant.GetPositions(one.team.plant.GetMyContextFromRoot(context))[one.team.position_index]
        for one, context in zip((loop, there), contexts, strict=True)
    ]
    assert states[0] - states[1] == pytest.approx([0.01, -0.02, 0.03, 0.04, -0.05])
    assert states[1] == pytest.approx(there.plan.start)
    assert loop.plan.start == pytest.approx(there.plan.start)


def test_before_the_start_everything_stood_still():
    loop = loop_of(control_rate=200.0, measurements=Measurements(delay=0.02))
    root = loop.create_context()
    for state in outputs(loop.bare_controllers, root, "object_state"):
        np.testing.assert_allclose(state, [*loop.plan.start[:3], 0.0, 0.0, 0.0], atol=1e-12)


def test_every_robot_has_noise_of_its_own_and_a_seed_decides_it():
    def measured(seed):
        loop = loop_of(control_rate=200.0, measurements=NOISE, seed=seed)
        simulator = Simulator(loop.diagram, loop.create_context())
        simulator.AdvanceTo(0.05)
        return np.array(inputs(loop, simulator.get_context(), "object_pose")[0])

    first = measured(1)
    assert np.array_equal(measured(1), first)
    assert not np.array_equal(measured(2), first)
    assert not np.array_equal(*first)


def test_positions_angles_and_rates_have_deviations_of_their_own():
    controller = loop_of(control_rate=200.0, measurements=NOISE).controllers[0]
    rates = [0.03] * 4
    for name, expected in (
        ("object_pose", [0.01, 0.01, 0.02]),
        ("robot_state", [0.01, 0.01, 0.02, 0.02, *rates]),
    ):
        noise = controller.GetSubsystemByName(f"{name}_measured")
        context, found = noise.CreateDefaultContext(), []
        noise.get_input_port().FixValue(context, np.zeros(len(expected)))
        for period in range(400):
            context.SetTime(period / 200.0)
            found.append(noise.get_output_port().Eval(context))
        np.testing.assert_allclose(np.std(found, axis=0), expected, rtol=0.15)


def test_where_no_limit_is_given_the_limit_lets_every_effort_pass_but_those_of_a_lost_run():
    loop = loop_of(mass_error=0.1)
    limit = loop.controllers[0].GetSubsystemByName("actuator_limits")
    context = limit.CreateDefaultContext()
    for asked, given in ((5e4, 5e4), (1e9, 1e5), (-np.inf, -1e5)):
        limit.get_input_port().FixValue(context, np.full(4, asked))
        along = given if asked == given else given / np.sqrt(2.0)  # the force is limited by its length
        expected = [along, along, given, given]
        np.testing.assert_allclose(limit.get_output_port().Eval(context), expected, rtol=1e-14)


def test_actuators_follow_their_commands_with_a_lag():
    """In continuous time: the rate of what is given is what is still missing, over the time constant."""
    loop, lag = loop_of(actuators=ActuatorLimits(lag=0.02)), 0.02
    simulator = Simulator(loop.diagram, loop.create_context())
    given = []
    for time in (0.0, 0.1, 0.1 + 1e-5):
        simulator.AdvanceTo(time)
        root = simulator.get_context()
        given.append(outputs(loop.controllers, root, "robot_effort"))
        wanted = outputs(loop.bare_controllers, root, "robot_effort")
    given = np.array(given)
    np.testing.assert_array_equal(given[0], 0.0)
    expected = (np.array(wanted) - given[2]) / lag
    np.testing.assert_allclose((given[2] - given[1]) / 1e-5, expected, rtol=1e-2, atol=0.1)
    assert np.abs(expected).max() > 10.0


def test_a_controller_gets_the_waves_of_what_it_measures():
    waves = Waves(*[Wave(0.001 * (1 + i), period=0.02, phase=0.5) for i in range(8)])
    loop = loop_of(control_rate=100.0, measurements=Measurements(waves=waves))
    root, expected = loop.create_context(), loop_of(control_rate=100.0)
    exact = expected.create_context()
    for port, errors in (
        ("object_pose", [1, 2, 3]),
        ("robot_state", [0, 0, 0, 4, 5, 6, 7, 8]),
    ):
        (read, *_), _ = inputs(loop, root, port)
        (true, *_), _ = inputs(expected, exact, port)
        np.testing.assert_allclose(read - true, -0.001 * np.array(errors), atol=1e-12)


@pytest.mark.parametrize("periods", [1, 2, 4])
def test_a_controller_gets_measurements_of_the_age_that_is_stated(periods):
    """At the instant at which it computes its effort, which is held from then on."""
    loop = loop_of(control_rate=100.0, measurements=Measurements(delay=0.01 * periods))
    simulator, true, known = Simulator(loop.diagram, loop.create_context()), [], []
    for k in range(12):
        simulator.AdvanceTo(0.01 * k)  # the updates of this instant are still to come
        root = simulator.get_context()
        true += outputs([loop.station.diagram], root, "object_pose")
        known.append(inputs(loop, root, "object_pose")[0][0])
    np.testing.assert_array_equal(known[periods:], true[:-periods])
    assert np.abs(np.subtract(true[-1], true[-2])).max() > 1e-9


def test_robots_that_overestimate_masses_push_harder():
    efforts = []
    for error in (0.0, 0.5):
        loop = loop_of(mass_error=error)
        root = loop.create_context()
        root.SetTime(0.3)  # walls and k1 begin at rest
        efforts.append(outputs(loop.bare_controllers, root, "robot_effort"))
    np.testing.assert_allclose(efforts[1], 1.5 * np.array(efforts[0]), rtol=1e-9, atol=1e-9)
    assert np.abs(efforts[0]).max() > 0.1


PERIOD = 0.01


def in_first(**departures):
    return {"robots": {"robot_0": RobotDepartures(**departures)}}


def test_a_bias_is_that_of_one_robot_or_of_all_others():
    bias, common = PoseBias(0.1, -0.2, 0.3), PoseBias(x=1.0)
    loop = sampled_loop(robots={"robot_0": RobotDepartures(bias), "*": RobotDepartures(common)})
    inside, outside = inputs(loop, loop.create_context(), "object_pose")
    np.testing.assert_allclose(inside[0] - outside[0], [0.1, -0.2, 0.3])
    np.testing.assert_allclose(inside[1] - outside[1], [1.0, 0.0, 0.0])


def test_odometry_scales_the_rates_of_the_base_alone():
    loop = sampled_loop(**in_first(odometry_scale=0.5))
    root, plant = loop.create_context(), loop.team.plant
    moving = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    set_configuration(loop.team, plant.GetMyMutableContextFromRoot(root), loop.plan.start, moving)
    inside, outside = inputs(loop, root, "robot_state")
    np.testing.assert_allclose(inside[0], outside[0] * [1, 1, 1, 1, 1.5, 1.5, 1.5, 1])
    np.testing.assert_array_equal(inside[1], outside[1])


def test_a_clock_that_is_ahead_takes_more_time_to_have_passed():
    loop = sampled_loop(**in_first(clock_error=0.25))
    inside, outside = inputs(loop, loop.create_context(), "current_cell")
    np.testing.assert_allclose(inside[0] - outside[0], [0.0, -0.25])
    np.testing.assert_array_equal(inside[1], outside[1])


def test_a_late_robot_hears_of_a_switch_later_than_the_others():
    loop = sampled_loop(**in_first(switch_delay=3 * PERIOD))
    simulator, cells = Simulator(loop.diagram, loop.create_context()), []
    for k in range(100):
        simulator.AdvanceTo(k * PERIOD - 1e-9 * bool(k))  # just before controllers compute
        inside, _ = inputs(loop, simulator.get_context(), "current_cell")
        cells.append([cell[0] for cell in inside])
    late, prompt = np.transpose(cells)
    assert prompt[-1] >= 1.0
    np.testing.assert_array_equal(late[3:], prompt[:-3])


def test_a_robot_that_samples_later_changes_its_effort_later():
    loop = sampled_loop(**in_first(sample_offset=0.004))
    simulator, given = Simulator(loop.diagram, loop.create_context()), []
    for time in (0.102, 0.106, 0.112):
        simulator.AdvanceTo(time)
        given.append(outputs(loop.controllers, simulator.get_context(), "robot_effort"))
    same = [[np.array_equal(a, b) for a, b in zip(*pair, strict=True)] for pair in pairwise(given)]
    assert same == [[False, True], [True, False]]


@pytest.mark.slow
@pytest.mark.parametrize("motors", ["working", "held", "limp"])
def test_a_silent_robot_sends_its_last_report_and_its_motors_do_as_stated(motors):
    loop = sampled_loop(**in_first(silence=Silence(0.3, 0.1, motors)))
    simulator, seen = Simulator(loop.diagram, loop.create_context()), []
    for time in (0.295, 0.305, 0.355, 0.395, 0.405):
        simulator.AdvanceTo(time)
        root = simulator.get_context()
        report = outputs(loop.controllers, root, "ready")[0]
        seen.append((report, *outputs(loop.controllers, root, "robot_effort")))
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


def sampled_loop(**deployment):
    return loop_of(control_rate=1.0 / PERIOD, **deployment)
