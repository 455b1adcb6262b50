import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.diagram import TELEMETRY, build_closed_loop
from coop_drake.errors import PlanError
from coop_drake.plant import set_configuration
from tests.support.configuration import get_configuration, get_rates
from tests.support.small_loop import TEAMS, small_loop, small_maps, small_problem
from tests.support.small_plan import small_plan
from tests.support.system_checks import port_sizes


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


def test_no_robot_is_told_anothers_state(loop):
    heard = [(source, sink) for source, (sink, entry) in links(loop) if source[1].endswith("_state")]
    for (_, port), sink in heard:
        assert port.split("_")[1] == sink.split("_")[1]
    assert len(heard) == len(loop.controllers)


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


def test_of_a_report_only_its_cell_and_its_sign_count():
    """A margin's size tells the cell planner nothing: one bit and an index are what crosses."""
    planner = small_loop("base").cell_planner
    outcomes = set()
    for margin in (0.0, 1e-9, 0.3, 1e6, np.inf):
        context = planner.CreateDefaultContext()
        for k in range(2):
            planner.GetInputPort(f"robot_{k}_ready").FixValue(context, [0.0, margin])
        simulator = Simulator(planner, context)
        simulator.AdvanceTo(0.01)
        outcomes.add(tuple(simulator.get_context().get_discrete_state_vector().value()))
    assert outcomes == {(1.0, 0.0)}


def test_nothing_enters_or_leaves_the_whole(loop):
    assert (loop.diagram.num_input_ports(), loop.diagram.num_output_ports()) == (0, 0)
    assert {system.get_name() for system in loop.diagram.GetSystems()} == {
        "transport_station",
        "cell_planner",
        *(f"robot_{k}_controller" for k in range(len(loop.controllers))),
    }


def test_a_controller_hears_three_things_and_no_more(loop):
    for robot, controller in zip(loop.team.robots, loop.controllers, strict=True):
        n = len(robot.joints)
        inputs, outputs = port_sizes(controller)
        assert inputs == {"robot_state": 2 * (3 + n), "object_pose": 3, "current_cell": 2}
        assert outputs == {
            "robot_effort": 3 + n,
            "ready": 2,
            "object_state": 6,
            "governor_position": 2,
            "energy_margin": 1,
            "funnels": 2 * (1 + n),
            "object_acceleration": 3,
            "hand_command": 6,
        }
        assert set(TELEMETRY) == set(outputs) - {"robot_effort", "ready"}


def test_every_robot_runs_every_block_of_the_law(loop):
    for controller in loop.controllers:
        assert {system.get_name() for system in controller.GetSystems()} == {
            "object_estimator",
            "reference_governor",
            "governor_rate",
            "governor_state",
            "axis_ppc",
            "wrench_law",
            "robot_effort",
            "ready_monitor",
        }


def test_station_ports(loop):
    n, joints = len(loop.team.joints), [len(robot.joints) for robot in loop.team.robots]
    inputs, outputs = port_sizes(loop.station.diagram)
    assert inputs == {f"robot_{k}_effort": 3 + n_k for k, n_k in enumerate(joints)}
    assert outputs == {
        "object_pose": 3,
        **{f"robot_{k}_state": 2 * (3 + n_k) for k, n_k in enumerate(joints)},
        "generalized_acceleration": 3 + n,
        "query_object": "abstract",
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


def test_robots_agree_on_the_objects_state_and_command(loop):
    context = loop.create_context()
    state = context.get_continuous_state_vector().CopyToVector()
    context.SetContinuousState(state + 0.01 * np.sin(np.arange(len(state))))
    for controller in loop.controllers:
        # The governors' copies are alike in a run: put them on one point.
        integrator = controller.GetSubsystemByName("governor_state")
        integrator.set_integral_value(integrator.GetMyMutableContextFromRoot(context), [3.0, 3.0])
    for output in ("object_state", "object_acceleration"):
        values = [
            controller.GetOutputPort(output).Eval(controller.GetMyContextFromRoot(context))
            for controller in loop.controllers
        ]
        for other in values[1:]:
            np.testing.assert_allclose(other, values[0], atol=1e-12)


def test_a_plan_for_another_team_is_refused():
    scenario, plan = small_problem("base")
    other = small_plan(("robot_0::elbow",))
    with pytest.raises(PlanError, match="the plan moves the joints robot_0::elbow; the scenario's team has"):
        build_closed_loop(scenario, other, small_maps())
    with pytest.raises(PlanError, match="a plan of 3 cells needs as many maps, not 2"):
        build_closed_loop(scenario, plan, small_maps()[:2])
