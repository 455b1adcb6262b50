import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource, ZeroOrderHold

from coop_drake.systems import CellPlanner
from tests.support.system_checks import (
    context_with,
    evaluate,
    state_of,
)


def advance(planner, context, until):
    simulator = Simulator(planner, context)
    simulator.Initialize()
    simulator.AdvanceTo(until)
    return list(planner.GetOutputPort("current_cell").Eval(simulator.get_context()))


def test_a_plan_starts_in_its_first_cell():
    np.testing.assert_array_equal(evaluate(CellPlanner(2, 3), {}, "current_cell"), [0.0, 0.0])


@pytest.mark.parametrize(
    ("ready", "cell"),
    [
        ([(0, 0.3), (0, 0.1)], 1),
        ([(0, 0.0), (0, 0.0)], 1),
        ([(0, 0.3), (0, -0.1)], 0),
        ([(0, -0.3), (0, 0.1)], 0),
        ([(-1, 0.3), (0, 0.1)], 0),
        ([(1, 0.3), (1, 0.1)], 0),
        ([(0, np.nan), (0, 0.1)], 0),
    ],
)
def test_it_advances_once_when_all_reports_speak_of_the_current_cell(ready, cell):
    planner = CellPlanner(2, 3)
    context = context_with(planner, {f"robot_{k}_ready": value for k, value in enumerate(ready)})
    # A report that speaks of cell 0 is stale in cell 1: further steps change nothing.
    assert advance(planner, context, 0.5)[0] == cell


def test_the_entry_time_is_the_time_of_the_switch():
    planner = CellPlanner(1, 3)
    context = context_with(planner, {"robot_0_ready": [0.0, 1.0]}, time=2.5)
    assert advance(planner, context, 2.6) == [1.0, 2.5]


def test_it_stays_in_the_last_cell_and_says_when_all_have_arrived():
    planner = CellPlanner(2, 1)
    ready = {"robot_0_ready": [0.0, 1.0], "robot_1_ready": [0.0, 1.0]}
    context = context_with(planner, ready)
    assert advance(planner, context, 0.1) == [0.0, 0.0]
    assert evaluate(planner, ready, "arrived") == [1.0]
    assert evaluate(planner, {**ready, "robot_1_ready": [0.0, -1.0]}, "arrived") == [0.0]
    assert evaluate(CellPlanner(2, 2), ready, "arrived") == [0.0]


class Echo(LeafSystem):
    """A robot that is always ready for whatever cell is current."""

    def __init__(self):
        super().__init__()
        cell = self.DeclareVectorInputPort("current_cell", 2)
        self.DeclareVectorOutputPort(
            "ready", 2, lambda context, output: output.SetFromVector([cell.Eval(context)[0], 1.0])
        )


def wired(planner, channel):
    """The planner with one eager robot; ``channel`` may hold its reports back."""
    builder = DiagramBuilder()
    builder.AddNamedSystem("planner", planner)
    robot = builder.AddNamedSystem("robot", Echo())
    builder.Connect(planner.GetOutputPort("current_cell"), robot.GetInputPort("current_cell"))
    source = robot.GetOutputPort("ready")
    if channel is not None:
        builder.AddNamedSystem("channel", channel)
        builder.Connect(source, channel.get_input_port())
        source = channel.get_output_port()
    builder.Connect(source, planner.GetInputPort("robot_0_ready"))
    return builder.Build()


def test_reports_that_depend_on_the_cell_close_no_algebraic_loop():
    diagram = wired(CellPlanner(1, 3), None)
    assert not diagram.HasAnyDirectFeedthrough()


def test_a_channel_that_holds_samples_never_switches_twice_on_one_report():
    planner = CellPlanner(1, 9, period=0.01)
    channel = ZeroOrderHold(period_sec=0.03, offset_sec=0.0, vector_size=2)
    diagram = wired(planner, channel)
    context = diagram.CreateDefaultContext()
    held = channel.GetMyMutableContextFromRoot(context)
    held.SetDiscreteState([-1.0, 1.0])
    simulator = Simulator(diagram, context)
    simulator.Initialize()
    cells = []
    for step in range(1, 13):
        simulator.AdvanceTo(0.01 * step + 0.005)
        cells.append(int(planner.GetMyContextFromRoot(context).get_discrete_state_vector()[0]))
    # The first sample reaches the planner one period late; then one switch for each new sample.
    assert cells == [1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]


def test_evaluating_outputs_leaves_the_state():
    planner = CellPlanner(1, 2)
    context = context_with(planner, {"robot_0_ready": [0.0, 1.0]})
    before = state_of(context)
    for output in ("current_cell", "arrived"):
        planner.GetOutputPort(output).Eval(context)
    assert state_of(context) == before


def test_a_constant_source_can_stand_for_a_robot():
    builder = DiagramBuilder()
    planner = builder.AddSystem(CellPlanner(1, 3))
    source = builder.AddSystem(ConstantVectorSource([0.0, 1.0]))
    builder.Connect(source.get_output_port(), planner.GetInputPort("robot_0_ready"))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.3)
    context = planner.GetMyContextFromRoot(simulator.get_context())
    assert planner.GetOutputPort("current_cell").Eval(context)[0] == 1.0


@pytest.mark.parametrize(
    ("robots", "cells", "period", "message"),
    [
        (0, 3, None, "at least one robot and one cell, not 0 and 3"),
        (2, 0, None, "at least one robot and one cell, not 2 and 0"),
        (2, 3, 0.0, "period must be positive, not 0.0"),
        (2, 3, -1.0, "period must be positive, not -1.0"),
    ],
)
def test_bad_parameters_are_refused(robots, cells, period, message):
    with pytest.raises(ValueError, match=message):
        CellPlanner(robots, cells, period=period)
