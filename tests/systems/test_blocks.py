"""Every block: its table of ports and its state, and which arguments are refused."""

import inspect
import re
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.framework import Diagram, LeafSystem

from benchmarks.one_process import DirectExchange
from coop_drake import systems
from coop_drake.diagram import build_closed_loop, build_world
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
from coop_drake.simulation import build_maps
from tests.support.small_loop import small_maps, small_problem
from tests.support.system_checks import SIZE_OF_ABSTRACT, port_sizes, state_of
from tests.support.tubes import WITH_AXES, tubed_problem

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
    own, (scenario, plan) = small_problem("base"), tubed_problem(WITH_AXES)
    tubed, hold = (scenario, plan, build_maps(plan)), Control(hold=Hold(at=(1.0,)))
    everything = {"deployment": EVERYTHING, "control": Control(predictor=True, observer=True, hold=Hold())}
    separate = {"plant": PlantSettings(grasps="constraints")}
    found = {}
    for (scenario, plan, maps), changes in (
        (tubed, {"control": hold}),
        ((*own, small_maps()), everything),
        ((*own, small_maps()), separate),
    ):
        loop = build_closed_loop(replace(scenario, **changes), plan, maps)
        for leaf in leaves(loop.diagram):
            found.setdefault(type(leaf).__name__, (leaf, loop))
    scenario, plan = own
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
        "NominalAxes",
        "NominalGovernor",
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
