"""The block diagram shows what is wired, and nothing else."""

import pytest

from coop_drake.diagram import TELEMETRY
from coop_drake.viz.block_diagram import INPUTS, OUTPUTS, block_diagram_figure, signal_flow
from tests.support.small_loop import small_loop


@pytest.fixture(scope="module")
def loop():
    return small_loop("three")


@pytest.fixture(scope="module")
def controller(loop):
    return signal_flow(loop.bare_controllers[1], "controller", telemetry=frozenset(TELEMETRY))


def test_every_block_and_every_connection_of_the_loop_is_there(loop):
    flow = signal_flow(loop.diagram, "loop")
    assert {block.name for block in flow.blocks} == {
        system.get_name() for system in loop.diagram.GetSystems()
    }
    assert len(flow.signals) == len(loop.diagram.connection_map())
    assert {(s.source, s.sink) for s in flow.signals if s.output == "ready"} == {
        (f"robot_{k}_controller", "cell_planner") for k in range(3)
    }


def test_what_a_controller_hears_and_says_is_there_without_what_is_only_looked_at(controller):
    blocks = {block.name: block for block in controller.blocks}
    assert set(blocks[INPUTS].outputs) == {"robot_state", "object_pose", "current_cell"}
    assert set(blocks[OUTPUTS].inputs) == {"robot_effort", "ready"}
    assert blocks["reference_governor"].kind == "ReferenceGovernor"


def test_signals_go_from_left_to_right_but_those_that_are_held(controller):
    columns = {block.name: block.column for block in controller.blocks}
    back = {s.source for s in controller.signals if columns[s.source] >= columns[s.sink]}
    assert back == {"governor_state"}


def test_the_picture_names_every_block_and_port(loop, controller):
    figure = block_diagram_figure(loop, robot=1)
    texts = {text.get_text() for ax in figure.axes for text in ax.texts}
    for block in controller.blocks:
        assert {block.name.replace("_", " "), *block.inputs, *block.outputs} <= texts
    assert {"robot 2 controller", "cell planner", "transport station"} <= texts
    assert "Controller of robot 1" in {text.get_text() for text in figure.axes[1].texts}


def test_a_robot_that_is_not_there_is_refused(loop):
    with pytest.raises(IndexError, match="robot 3 is not in the team of 3"):
        block_diagram_figure(loop, robot=3)
