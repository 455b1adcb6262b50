"""Blocks: ports, state and arguments of each, and those next to the plant."""

import inspect
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.systems.framework import Diagram, DiagramBuilder, LeafSystem

from benchmarks.one_process import DirectExchange
from coop_drake import systems
from coop_drake.diagram import build_closed_loop, build_world
from coop_drake.diagram.robot_controller import team_schedule
from coop_drake.laws import acceleration_at, wrench_share
from coop_drake.laws.departures import CREEP_SPEED, act_on_wrenches, without_departures
from coop_drake.plant import (
    base_poses,
    build_robot_plant,
    build_team_plant,
    set_configuration,
)
from coop_drake.scenario import (
    ActuatorLimits,
    BlockedWheels,
    Control,
    Deployment,
    Floor,
    Hold,
    JointFriction,
    Measurements,
    Messages,
    PlantSettings,
    Push,
    RobotDepartures,
    Silence,
    WheelSlip,
)
from tests.support.motions import motion_under_budget
from tests.support.robot_matrices import turned
from tests.support.small_loop import small_maps, small_problem
from tests.support.small_plan import with_motion
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import SIZE_OF_ABSTRACT, evaluate, port_sizes, state_of

ROW = re.compile(r"^ *(input|output) +``(\S+)`` +(\S(?:.*?\S)?)(?:  |$)", re.MULTILINE)


BLOCKS = sorted(
    name
    for name, thing in vars(systems).items()
    if inspect.isclass(thing) and issubclass(thing, LeafSystem) and thing is not systems.Block
)


EVERYTHING = Deployment(
    control_rate=100.0,
    measurements=Measurements(loss=0.1, delay=0.02, angle_noise=1e-3),
    messages=Messages(loss=0.1),
    robots={"*": RobotDepartures(silence=Silence(1.0), blocked=BlockedWheels(1.0), slip=WheelSlip(1.0, 0.5))},
    floor=Floor(coulomb_friction=1.0),
    joint_friction=JointFriction(coulomb=0.1),
    pushes=(Push("object", (1.0, 0.0), time=1.0, duration=0.5),),
    actuators=ActuatorLimits(lag=0.01),
    clock_error=0.001,
)


def leaves(system):
    if isinstance(system, Diagram):
        return [leaf for part in system.GetSystems() for leaf in leaves(part)]
    return [system]


@pytest.fixture(scope="module")
def blocks():
    """One of each block: from loops with a budget, one that is sampled, and one whose robots are separate."""
    own, (scenario, plan) = small_problem("base"), motion_under_budget()
    led, hold = (scenario, plan, small_maps()), Control(hold=Hold(at=(1.0,)))
    everything = {"deployment": EVERYTHING, "control": Control(predictor=True, observer=True, hold=Hold())}
    separate = {"plant": PlantSettings(grasps="constraints")}
    found = {}
    for (scenario, plan, maps), changes in (
        (led, {"control": hold}),
        ((*own, small_maps()), everything),
        ((*own, small_maps()), separate),
    ):
        loop = build_closed_loop(replace(scenario, **changes), plan, maps)
        for leaf in leaves(loop.diagram):
            found.setdefault(type(leaf).__name__, (leaf, loop))
    scenario, plan = own
    sampled = replace(scenario, deployment=Deployment(control_rate=200.0))
    loop = build_closed_loop(sampled, with_motion(plan), small_maps())
    for leaf in leaves(loop.diagram):
        found.setdefault(type(leaf).__name__, (leaf, loop))
    known = team_schedule(sampled, with_motion(plan)), systems.Radio(0, 2)
    found["RobotWords"] = systems.RobotWords(*known, alarmed=True, ahead=0.01), loop
    world = build_world(replace(scenario, deployment=EVERYTHING), plan, DirectExchange())
    found["TeamLink"] = world.link, world
    return found


def table(block):
    """Name and size of every port that the docstring lists, inputs and outputs apart."""
    listed = {"input": {}, "output": {}}
    for kind, name, size in ROW.findall(type(block).__doc__):
        for k in range(2) if "<k>" in name else (0,):
            listed[kind][name.replace("<k>", str(k))] = size
    return listed["input"], listed["output"]


@pytest.mark.parametrize("name", BLOCKS)
def test_the_table_lists_all_ports_and_no_others(blocks, name):
    block, _ = blocks[name]
    for listed, actual in zip(table(block), port_sizes(block), strict=True):
        assert list(listed) == list(actual)
        for port, size in listed.items():
            if size.isdigit() or size == SIZE_OF_ABSTRACT:
                assert str(actual[port]) == size, port


@pytest.mark.parametrize("name", BLOCKS)
def test_a_block_without_state_has_none_and_any_other_says_which(blocks, name):
    block, _ = blocks[name]
    continuous, discrete = state_of(block.CreateDefaultContext())
    stateless = not continuous and not discrete
    assert stateless == bool(re.search(r"^ *No state", type(block).__doc__, re.MULTILINE))
    if not stateless:
        assert re.search(r"^ *State: ", type(block).__doc__, re.MULTILINE)


def missing_input(output, context):
    """The input that an output names because it is not connected; None where it needs none."""
    try:
        output.Eval(context)
    except RuntimeError as error:
        return re.search(r"InputPort\[\d+\] \((\S+)\) .* is not connected", str(error))[1]
    return None


@pytest.mark.parametrize("name", BLOCKS)
def test_an_output_says_which_of_its_inputs_is_not_connected(blocks, name):
    block, _ = blocks[name]
    context, inputs = block.CreateDefaultContext(), set(port_sizes(block)[0])
    outputs = [block.get_output_port(i) for i in range(block.num_output_ports())]
    assert {missing_input(output, context) for output in outputs} <= {None, *inputs}


def test_only_switches_jumps_holds_what_is_predicted_and_what_models_failures_are_remembered(blocks):
    remembering = {name for name in BLOCKS if any(map(len, state_of(blocks[name][0].CreateDefaultContext())))}
    failures = {"Interruption", "LaggingEffort", "LossyMeasurement", "MessageChannel", "ShiftedMeasurement"}
    holds = {"FunnelClock", "HoldMonitor", "HoldReceiver", "HoldSupervisor"}
    laws = {
        "CellPlanner",
        "ArrivalMonitor",
        "AxisPpc",
        "StatePredictor",
        "RobotWords",
        "WordPlanner",
    }
    assert remembering == laws | holds | failures | {"TeamLink", "DepartureMonitor"}


WAVES = np.array([[0.3, 4.0, 0.0], [0.0, 1.0, 0.0]])
LOAD = {"p_LLcm": np.zeros(2), "mass": 1.0, "inertia": 1.0, "share": 0.5, "joints": 0}
REFUSED = [
    (systems.CellPlanner, (0, 3), {}, "at least one robot and one cell, not 0 and 3"),
    (systems.CellPlanner, (2, 0), {}, "at least one robot and one cell, not 2 and 0"),
    (systems.CellPlanner, (2, 3), {"period": 0.0}, "period must be positive, not 0.0"),
    (systems.CellPlanner, (2, 3), {"period": -1.0}, "period must be positive, not -1.0"),
    (systems.DisturbanceObserver, (1, 0.0, 1.0), {}, "a positive gain and no negative leak"),
    (systems.DisturbanceObserver, (1, 5.0, -1.0), {}, "a positive gain and no negative leak"),
    (systems.FloorFriction, ([1], -1.0, 0.0), {}, "no negative friction"),
    (systems.FloorFriction, ([1], 0.0, -1.0), {}, "no negative friction"),
    (systems.Interruption, (1, 0.0), {"begin": 1.0}, "positive period and duration"),
    (systems.Interruption, (1, 0.1), {"begin": 1.0, "duration": 0.0}, "positive period and duration"),
    (systems.LaggingEffort, (2, 0.0, 0.02), {}, "needs a positive lag and period"),
    (systems.LaggingEffort, (2, -0.03, 0.02), {}, "needs a positive lag and period"),
    (systems.LaggingEffort, (2, 0.03, 0.0), {}, "needs a positive lag and period"),
    (systems.LimitedEffort, (np.array([1.0, 0.0]),), {}, "needs positive limits"),
    (systems.LossyMeasurement, (1, 0.0), {}, "positive period"),
    (systems.LossyMeasurement, (1, 0.1), {"late_by": -1.0}, "no negative delay"),
    (systems.LossyMeasurement, (1, 0.1), {"loss": 1.5}, "probabilities"),
    (systems.LossyMeasurement, (1, 0.1), {"late": -0.5}, "probabilities"),
    (
        systems.MeasurementNoise,
        (np.ones(2), WAVES, 0.0, 1),
        {},
        "no negative deviation and waves of",
    ),
    (systems.MeasurementNoise, (-np.ones(2), WAVES, 0.1, 1), {}, "no negative deviation and waves of"),
    (systems.MeasurementNoise, (np.ones(2), 0.0 * WAVES, 0.1, 1), {}, "no negative deviation and waves of"),
    (systems.MessageChannel, (0.0,), {}, "positive period"),
    (systems.MessageChannel, (0.1,), {"delay": -1.0}, "no negative delay"),
    (systems.MessageChannel, (0.1,), {"loss": 1.5}, "probabilities must lie in"),
    (systems.MessageChannel, (0.1,), {"repeat": np.nan}, "probabilities must lie in"),
    (systems.WrenchLaw, (np.zeros(2),), LOAD | {"mass": 0.0}, "needs positive mass and inertia, not"),
    (systems.WrenchLaw, (np.zeros(2),), LOAD | {"inertia": -1.0}, "needs positive mass and inertia, not"),
    (systems.WrenchLaw, (np.zeros(2),), LOAD | {"mass": np.nan}, "needs positive mass and inertia, not"),
    (systems.WrenchLaw, (np.zeros(2),), LOAD | {"share": -0.1}, "share must lie in"),
    (systems.WrenchLaw, (np.zeros(2),), LOAD | {"share": 1.1}, "share must lie in"),
    (systems.WrenchLaw, (np.zeros(2),), LOAD | {"share": np.nan}, "share must lie in"),
    (systems.AxisPpc, ([],), {}, "AxisPpc needs one law for each cell, all of the same axes"),
    (systems.ReferenceGovernor, ([],), {}, "ReferenceGovernor needs at least one cell"),
    (systems.ReadyMonitor, ([], [], [], np.zeros(2), 0.01), {}, "one inradius for each cell, not 0, 0 and 0"),
]


@pytest.mark.parametrize(("block", "arguments", "more", "complaint"), REFUSED)
def test_wrong_arguments_are_refused(block, arguments, more, complaint):
    with pytest.raises(ValueError, match=complaint):
        block(*arguments, **more)


# Blocks next to the plant: sensors, efforts, actuators, friction and the load's wrench.


TEAMS = ("base", "elbow", "three")


class Rig:
    """A shipped team in a configuration where nothing is symmetric, moving."""

    def __init__(self, team):
        self.scenario = small_scenario(team)
        self.team = build_team_plant(self.scenario, DiagramBuilder())
        generator = np.random.default_rng(3)
        n = len(self.team.joints)
        self.z = np.array([3.0, 3.0, 0.4, *generator.uniform(-0.8, 0.8, n)])
        self.rates = generator.uniform(-0.5, 0.5, 3 + n)
        self.context = self.team.plant.CreateDefaultContext()
        set_configuration(self.team, self.context, self.z, self.rates)
        self.team_state = self.team.plant.GetPositionsAndVelocities(self.context)

    def measured(self):
        """The object's pose, then every robot's state."""
        sensor = systems.TeamSensor(self.team)
        values = evaluate(sensor, {"team_state": self.team_state}, "measurements")
        return np.split(values, np.cumsum(sensor.sizes)[:-1])

    def robot_state(self, k):
        return self.measured()[1 + k]

    def grasp(self, k):
        X_LE = self.team.robots[k].X_LE
        return np.array([X_LE.x, X_LE.y])


@pytest.fixture(scope="module", params=TEAMS)
def rig(request):
    return Rig(request.param)


def test_the_team_sensor_reads_the_object_and_every_robots_base_and_joints(rig):
    sensor, states = systems.TeamSensor(rig.team), rig.team.plant.num_multibody_states()
    sizes = [3, *(2 * (3 + len(robot.joints)) for robot in rig.team.robots)]
    assert sensor.sizes == sizes
    assert port_sizes(sensor) == ({"team_state": states}, {"measurements": sum(sizes)})
    pose, *robots = rig.measured()
    np.testing.assert_array_equal(pose, rig.z[:3])
    ahead, step = rig.team.plant.CreateDefaultContext(), 1e-6
    set_configuration(rig.team, ahead, rig.z + step * rig.rates)
    behind = rig.team.plant.CreateDefaultContext()
    set_configuration(rig.team, behind, rig.z - step * rig.rates)
    base_rates = (base_poses(rig.team, ahead) - base_poses(rig.team, behind)) / (2.0 * step)
    for robot, state in zip(rig.team.robots, robots, strict=True):
        n = len(robot.joints)
        np.testing.assert_allclose(state[:3], base_poses(rig.team, rig.context)[robot.index], atol=1e-14)
        np.testing.assert_array_equal(state[3 : 3 + n], rig.z[3:][robot.q_slice])
        np.testing.assert_allclose(state[3 + n : 6 + n], base_rates[robot.index], atol=1e-8)
        np.testing.assert_array_equal(state[6 + n :], rig.rates[3:][robot.q_slice])


def test_every_robot_finds_the_objects_state_from_its_own_motion(rig):
    for robot in rig.team.robots:
        k, n = robot.index, len(robot.joints)
        system = systems.ObjectEstimator(build_robot_plant(rig.scenario, k), rig.grasp(k))
        assert port_sizes(system) == ({"robot_state": 2 * (3 + n), "object_pose": 3}, {"object_state": 6})
        inputs = {"robot_state": rig.robot_state(k), "object_pose": rig.z[:3]}
        known = evaluate(system, inputs, "object_state")
        np.testing.assert_array_equal(known[:3], rig.z[:3])
        np.testing.assert_allclose(known[3:], rig.rates[:3], atol=1e-13)


@pytest.mark.parametrize(
    ("asked", "given"),
    [
        ([6.0, -8.0, 0.0, 0.0], [3.0, -4.0, 0.0, 0.0]),
        ([2.0, -np.inf, 0.0, np.inf], [0.0, -5.0, 0.0, 0.5]),
        ([4.0, 3.0, 0.0, 0.0], [4.0, 3.0, 0.0, 0.0]),
        ([0.0, 1.0, -3.0, 0.7], [0.0, 1.0, -2.0, 0.5]),
    ],
)
def test_a_force_is_limited_by_its_length_and_torques_and_joints_one_by_one(asked, given):
    limited = evaluate(systems.LimitedEffort(np.array([5.0, 2.0, 0.5])), {"asked": asked}, "given")
    np.testing.assert_allclose(limited, given, rtol=1e-14)


SPEEDS = st.floats(-3.0, 3.0)


def base_friction(vx, vy, coulomb, viscous):
    """What the floor does to one base, and no torque."""
    world, wrenches = (
        without_departures(1)._replace(floor=np.array([coulomb, viscous, 0.0])),
        np.zeros((1, 3)),
    )
    act_on_wrenches(world, 0.0, 0.0, np.array([[vx, vy]]), wrenches)
    assert wrenches[0, 2] == 0.0
    return wrenches[0, :2]


@given(SPEEDS, SPEEDS, st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_friction_opposes_motion_and_is_no_stronger_than_stated(vx, vy, coulomb, viscous):
    force, speed = base_friction(vx, vy, coulomb, viscous), np.hypot(vx, vy)
    assert force @ [vx, vy] <= 0.0
    assert force[0] * vy == pytest.approx(force[1] * vx, abs=1e-9)
    assert np.hypot(*force) <= (coulomb + viscous * speed) * (1.0 + 1e-12)
    if speed > 10.0 * CREEP_SPEED:
        assert np.hypot(*force) >= 0.99 * (coulomb + viscous * speed)


def test_wheels_that_slip_lose_their_share_for_their_time():
    block = systems.WheelSlips(np.array([[1.0, np.inf], [2.0, np.inf], [0.3, 0.0]]))
    driven = np.arange(1.0, 7.0)
    for time, left in ((0.9, 1.0), (1.0, 0.7), (1.9, 0.7), (2.0, 1.0)):
        passed = evaluate(block, {"driven": driven}, "passed", time)
        np.testing.assert_allclose(passed, driven * [left, left, left, 1.0, 1.0, 1.0], rtol=1e-15)


def test_pushes_add_up_on_what_they_push_while_they_last():
    block = systems.Pushes(1, np.array([[0, 5.0, -1.0, 0.2, 1.0, 2.0], [1, 0.0, 3.0, 0.4, 1.5, 3.0],
                                        [1, 1.0, 1.0, 0.0, 1.5, 2.0]]))  # fmt: skip
    assert port_sizes(block) == ({"asked": 3}, {"pushed": 6})
    for time, own, on_object in (
        (0.9, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]), (1.0, [5.0, -1.0, 0.2], [0.0, 0.0, 0.0]),
        (1.5, [5.0, -1.0, 0.2], [1.0, 4.0, 0.4]), (2.0, [0.0, 0.0, 0.0], [0.0, 3.0, 0.4]),
        (3.0, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    ):  # fmt: skip
        pushed = evaluate(block, {"asked": [7.0, 8.0, 9.0]}, "pushed", time)
        np.testing.assert_allclose(pushed, [*np.add([7.0, 8.0, 9.0], own), *on_object], rtol=1e-15)


def test_every_base_has_its_own():
    block = systems.FloorFriction([1, 0], 30.0, 2.0)
    assert port_sizes(block) == ({"robot_0_state": 8, "robot_1_state": 6}, {"friction_wrenches": 6})
    inputs = {
        "robot_0_state": [1.0, 2.0, 3.0, 4.0, 0.3, 0.4, 5.0, 6.0],
        "robot_1_state": [1.0, 2.0, 3.0, 0.0, -1.0, 4.0],
    }
    expected = [*base_friction(0.3, 0.4, 30.0, 2.0), 0.0, *base_friction(0.0, -1.0, 30.0, 2.0), 0.0]
    np.testing.assert_array_equal(evaluate(block, inputs, "friction_wrenches"), expected)


def test_the_hand_s_command_is_the_law():
    """Acceleration of the grasp and the robot's share of the wrench, from what governor and axes command."""
    p_LE, p_LLcm, wanted = np.array([0.4, 0.1]), np.array([0.05, -0.02]), np.array([1.2, -0.4, 2.0])
    law = systems.WrenchLaw(p_LE, p_LLcm=p_LLcm, mass=3.0, inertia=0.7, share=0.25, joints=2)
    inputs = {
        "object_state": [3.8, 3.5, 0.7, 0.3, 0.1, 0.9],
        "governor_command": [7.0, 8.0, 1.2, -0.4],
        "axis_acceleration": [2.0, 9.0, 10.0],
    }
    np.testing.assert_array_equal(evaluate(law, inputs, "object_acceleration"), wanted)
    r, com = turned(0.7, p_LE), turned(0.7, p_LLcm)
    grasp, share = np.split(evaluate(law, inputs, "hand_command"), 2)
    np.testing.assert_allclose(grasp, [*acceleration_at(*r, *wanted, 0.9), 2.0], rtol=1e-14)
    of_com = acceleration_at(*com, *wanted, 0.9)
    np.testing.assert_allclose(share, wrench_share(*(com - r), *of_com, 2.0, 3.0, 0.7, 0.25), rtol=1e-14)
