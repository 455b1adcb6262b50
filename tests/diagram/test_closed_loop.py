"""The loop of named blocks: what crosses between robots, where it starts, and what acts on the plant."""

import numpy as np
import pytest

from coop_drake.diagram import build_closed_loop, build_station
from coop_drake.errors import PlanError
from coop_drake.plant import set_configuration
from tests.support.configuration import get_configuration, get_rates
from tests.support.small_loop import TEAMS, small_loop, small_maps, small_problem
from tests.support.small_plan import small_plan
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import context_with


@pytest.fixture(scope="module", params=TEAMS)
def loop(request):
    return small_loop(request.param)


def links(loop):
    """Every connection of the whole, as (system, output) -> (system, input) by name."""
    return [
        (
            (source.get_name(), source.get_output_port(output).get_name()),
            (sink.get_name(), sink.get_input_port(entry).get_name()),
        )
        for (sink, entry), (source, output) in loop.diagram.connection_map().items()
    ]


def test_between_robots_only_ready_reports_cross(loop):
    names = [controller.get_name() for controller in loop.controllers]
    for k, name in enumerate(names):
        into = {entry: source for source, (sink, entry) in links(loop) if sink == name}
        assert into == {
            "robot_state": ("transport_station", f"robot_{k}_state"),
            "object_pose": ("transport_station", "object_pose"),
            "current_cell": ("cell_planner", "current_cell"),
        }
        out_of = {(source[1], sink) for source, sink in links(loop) if source[0] == name}
        assert out_of == {
            ("ready", ("cell_planner", f"robot_{k}_ready")),
            ("robot_effort", ("transport_station", f"robot_{k}_effort")),
        }
        assert loop.controllers[k].GetOutputPort("ready").size() == 2
    told = {source[0] for source, (sink, _) in links(loop) if sink == "cell_planner"}
    assert told == set(names)
    assert loop.cell_planner.GetOutputPort("current_cell").size() == 2


def outputs_of(controller, context):
    """Everything that leaves a controller, its telemetry too, bit by bit."""
    own = controller.GetMyContextFromRoot(context)
    ports = [controller.get_output_port(i) for i in range(controller.num_output_ports())]
    return {port.get_name(): port.Eval(own).tobytes() for port in ports}


def test_what_one_robot_does_changes_nothing_that_another_computes(loop):
    """Whatever the wires are called: another arm's posture and motion reach no output of this robot."""
    team, context = loop.team, loop.create_context()
    plant_context = team.plant.GetMyMutableContextFromRoot(context)
    z, rates = loop.plan.start.copy(), np.zeros(len(loop.plan.start))
    rates[:3] = 0.1, -0.2, 0.05
    set_configuration(team, plant_context, z, rates)
    before = [outputs_of(controller, context) for controller in loop.controllers]
    for robot in team.robots:
        moved, moving = z.copy(), rates.copy()
        moved[3:][robot.q_slice] += 0.05
        moving[3:][robot.q_slice] += 0.1
        set_configuration(team, plant_context, moved, moving)
        after = [outputs_of(controller, context) for controller in loop.controllers]
        for k, controller in enumerate(loop.controllers):
            if k == robot.index:
                assert after[k]["robot_effort"] != before[k]["robot_effort"]
            else:
                assert after[k] == before[k], controller.get_name()


def test_nothing_enters_or_leaves_the_whole(loop):
    assert (loop.diagram.num_input_ports(), loop.diagram.num_output_ports()) == (0, 0)
    assert {system.get_name() for system in loop.diagram.GetSystems()} == {
        "transport_station",
        "cell_planner",
        *(f"robot_{k}_controller" for k in range(len(loop.controllers))),
    }


def test_a_run_starts_at_rest_in_the_first_cell_with_every_governor_on_the_object(loop):
    context = loop.create_context()
    plant_context = loop.team.plant.GetMyContextFromRoot(context)
    np.testing.assert_allclose(get_configuration(loop.team, plant_context), loop.plan.start, atol=1e-15)
    np.testing.assert_array_equal(get_rates(loop.team, plant_context), np.zeros(3 + len(loop.team.joints)))
    planner = loop.cell_planner
    np.testing.assert_array_equal(
        planner.GetOutputPort("current_cell").Eval(planner.GetMyContextFromRoot(context)), [0.0, 0.0]
    )
    for controller in loop.controllers:
        governor = controller.GetOutputPort("governor_position").Eval(
            controller.GetMyContextFromRoot(context)
        )
        np.testing.assert_array_equal(governor, loop.plan.start[:2])


def test_the_state_is_the_teams_the_governors_the_cell_and_what_robots_remember_of_switches(loop):
    context = loop.create_context()
    expected = 2 * (3 + len(loop.team.joints)) + 2 * len(loop.controllers)
    assert context.num_continuous_states() == expected
    assert context.get_discrete_state().num_groups() == 1 + len(loop.controllers)


def test_a_plan_for_another_team_is_refused():
    scenario, plan = small_problem("base")
    other = small_plan(("robot_0::elbow",))
    with pytest.raises(PlanError, match="the plan moves the joints robot_0::elbow; the scenario's team has"):
        build_closed_loop(scenario, other, small_maps())
    with pytest.raises(PlanError, match="a plan of 3 cells needs as many maps, not 2"):
        build_closed_loop(scenario, plan, small_maps()[:2])


@pytest.fixture(scope="module", params=["base", "elbow", "three"])
def station(request):
    return build_station(small_scenario(request.param))


def efforts_of(team):
    generator = np.random.default_rng(7)
    return {
        f"robot_{robot.index}_effort": generator.normal(size=3 + len(robot.joints)) for robot in team.robots
    }


def test_actuation_needs_every_robots_effort(station):
    efforts, plant = efforts_of(station.team), station.team.plant
    del efforts["robot_1_effort"]
    context = plant.GetMyContextFromRoot(context_with(station.diagram, efforts))
    for port in (plant.get_applied_spatial_force_input_port(), plant.get_actuation_input_port()):
        with pytest.raises(RuntimeError, match="robot_1_effort"):
            port.Eval(context)
