"""The loop of named blocks: what crosses between robots, where it starts, and what acts on the plant."""

import numpy as np
import pytest

from coop_drake.diagram import TELEMETRY, build_closed_loop, build_station
from coop_drake.errors import PlanError
from coop_drake.plant import set_configuration
from tests.support.configuration import get_configuration, get_rates
from tests.support.small_loop import TEAMS, small_loop, small_maps, small_problem
from tests.support.small_plan import small_plan
from tests.support.small_scenario import small_scenario
from tests.support.system_checks import context_with, port_sizes


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


@pytest.fixture(scope="module", params=["base", "elbow", "three"])
def station(request):
    return build_station(small_scenario(request.param))


def efforts_of(team):
    generator = np.random.default_rng(7)
    return {
        f"robot_{robot.index}_effort": generator.normal(size=3 + len(robot.joints)) for robot in team.robots
    }


@pytest.fixture
def driven(station):
    """Efforts, and the plant's context in which they act on a team that stands askew."""
    team, efforts = station.team, efforts_of(station.team)
    root = context_with(station.diagram, efforts)
    z = np.array([3.0, 3.0, 0.4, *np.linspace(-0.8, 0.7, len(team.joints))])
    set_configuration(team, team.plant.GetMyMutableContextFromRoot(root), z)
    return efforts, root, team.plant.GetMyContextFromRoot(root)


def test_base_wrenches_act_on_bases_in_the_axes_of_the_world(station, driven):
    efforts, _root, context = driven
    forces = station.team.plant.get_applied_spatial_force_input_port().Eval(context)
    assert {force.body_index for force in forces} == {
        robot.base_body.index() for robot in station.team.robots
    }
    for robot, effort in zip(station.team.robots, efforts.values(), strict=True):
        on_base = [force for force in forces if force.body_index == robot.base_body.index()]
        for force in on_base:
            np.testing.assert_array_equal(force.p_BoBq_B, np.zeros(3))
        pushed = sum(force.F_Bq_W.translational() for force in on_base)
        turned = sum(force.F_Bq_W.rotational() for force in on_base)
        np.testing.assert_array_equal(pushed[:2], effort[:2])
        np.testing.assert_array_equal(turned, [0.0, 0.0, effort[2]])
        assert abs(pushed[2]) <= 1e-15 * np.abs(effort[:2]).sum()  # the floor holds what a right angle rounds


def test_joint_torques_act_on_joints(station, driven):
    efforts, _root, context = driven
    np.testing.assert_array_equal(
        station.team.plant.get_actuation_input_port().Eval(context),
        np.concatenate([effort[3:] for effort in efforts.values()]),
    )


def test_actuation_needs_every_robots_effort(station):
    efforts, plant = efforts_of(station.team), station.team.plant
    del efforts["robot_1_effort"]
    context = plant.GetMyContextFromRoot(context_with(station.diagram, efforts))
    for port in (plant.get_applied_spatial_force_input_port(), plant.get_actuation_input_port()):
        with pytest.raises(RuntimeError, match="robot_1_effort"):
            port.Eval(context)
