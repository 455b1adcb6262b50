"""Monitors of readiness, arrival and departures say what their laws say of what is measured."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.diagram import build_station
from coop_drake.diagram.robot_controller import robot_knowledge
from coop_drake.errors import ScenarioError
from coop_drake.laws.readiness import FAR, ArrivalGoal, arrival_margin, mean_samples
from coop_drake.scenario import Deployment
from coop_drake.systems import ArrivalMonitor, DepartureMonitor, ReadyMonitor, axis_laws
from coop_drake.systems.kernels import ready_conditions
from coop_drake.systems.passing import STAMPED
from tests.support.motions import motion_under_budget
from tests.support.readiness import margin_of
from tests.support.small_loop import governed_cells, small_maps
from tests.support.small_plan import GOAL_POSE, POSITION_TOLERANCE, small_plan, stiffer_and_stiffer
from tests.support.system_checks import context_with, evaluate, port_sizes

PLAN = stiffer_and_stiffer(small_plan(("a", "b", "c")))

AXES = [0, 2, 3]


INPUTS = {
    "object_state": [3.8, 3.5, 0.3, 0.0, 0.0, 0.0],
    "robot_state": [1.0, 2.0, 0.3, 0.1, 0.12, *[0.0] * 5],
    "governor_position": [3.8, 3.5],
    "current_cell": [0.0, 0.0],
}


@pytest.fixture
def monitor(cells):
    inradii = [transition.inradius for transition in PLAN.transitions]
    return ReadyMonitor(cells, axis_laws(PLAN, AXES), inradii, PLAN.goal_pose[:2], POSITION_TOLERANCE)


def conditions(cells):
    return ready_conditions(
        [law.table for law in axis_laws(PLAN, AXES)],
        [cell.clearance.edges for cell in cells],
        [cell.row for cell in cells],
        [transition.inradius for transition in PLAN.transitions],
        PLAN.goal_pose[:2],
        POSITION_TOLERANCE,
    )


@pytest.mark.parametrize("index", [0, 1])
def test_the_report_is_the_law_with_the_next_cells_energy(monitor, cells, index):
    inputs = {**INPUTS, "current_cell": [index, 0.0], "object_state": [3.8, 3.5, 0.3, 0.1, 0.0, 0.05]}
    expected = margin_of(
        conditions(cells)[index], [3.8, 3.5], [0.1, 0.0], INPUTS["governor_position"], [0.3, 0.1, 0.12],
        [0.05, 0.0, 0.0],
    )  # fmt: skip
    np.testing.assert_array_equal(evaluate(monitor, inputs, "ready", 10.0), [index, expected])


def test_in_the_last_cell_it_reports_arrival(monitor, cells):
    state = [0.0, 0.0, 0.0, 0.3, 0.28, 0.0, 0.0, 0.0, 0.001, 0.002]
    inputs = {
        **INPUTS,
        "current_cell": [2.0, 1.0],
        "object_state": [GOAL_POSE[0] + 0.002, GOAL_POSE[1], GOAL_POSE[2] + 0.001, 0.001, 0.0, 0.003],
        "robot_state": state,
    }
    expected = margin_of(
        conditions(cells)[2], inputs["object_state"][:2], [0.001, 0.0], [3.8, 3.5],
        [GOAL_POSE[2] + 0.001, 0.3, 0.28], [0.003, 0.001, 0.002],
    )  # fmt: skip
    assert expected > 0.0
    np.testing.assert_array_equal(evaluate(monitor, inputs, "ready", 10.0), [2.0, expected])


def test_bad_parameters_are_refused(cells):
    laws, goal = axis_laws(PLAN, AXES), np.zeros(2)
    with pytest.raises(ValueError, match="one inradius for each cell, not 3, 3 and 2"):
        ReadyMonitor(cells, laws, [0.1, 0.1], goal, 0.01)
    with pytest.raises(ValueError, match=r"position tolerance must be positive, not 0\.0"):
        ReadyMonitor(cells, laws, [0.1, 0.1, 0.1], goal, 0.0)


def test_in_the_last_cell_a_sampled_robot_says_what_it_measures(cells):
    inradii = [transition.inradius for transition in PLAN.transitions]
    parts = cells, axis_laws(PLAN, AXES), inradii, PLAN.goal_pose[:2], POSITION_TOLERANCE
    sampled, last = ReadyMonitor(*parts, measured=True), len(cells) - 1
    inputs = {**INPUTS, "current_cell": [last, 0.0], "arrival": [0.4]}
    assert evaluate(sampled, inputs, "ready").tolist() == [last, 0.4]
    assert evaluate(sampled, {**inputs, "arrival": [-1.0]}, "ready").tolist() == [last, -1.0]
    before = {**inputs, "current_cell": [0.0, 0.0], "arrival": [-1.0]}
    expected = evaluate(ReadyMonitor(*parts), {name: before[name] for name in INPUTS}, "ready")
    np.testing.assert_array_equal(evaluate(sampled, before, "ready"), expected)


@pytest.fixture(scope="module")
def cells():
    return governed_cells(PLAN)


PERIOD, CELLS = 0.01, 3

ARRIVAL = ArrivalGoal(np.array([3.0, 2.0, 0.5, 0.1]), np.array([0.01, 0.02, np.inf]), np.zeros(3))


def test_it_has_not_measured_enough_at_first_and_compares_means_in_the_last_cell_alone(arrivals):
    simulator = Simulator(arrivals, context_with(arrivals, ARRIVING))
    context, rows = simulator.get_mutable_context(), 2 * mean_samples(PERIOD)
    samples = np.array([[3.001, 2.0, 0.5, 0.1]] * rows)
    samples[:, 0] += 1e-4 * np.sin(np.arange(rows))
    for k, sample in enumerate(samples):
        arrivals.GetInputPort("object_pose").FixValue(context, sample[:3])
        assert evaluate_now(arrivals, context) == FAR, k
        simulator.AdvanceTo(PERIOD * k + 0.5 * PERIOD)
    expected = arrival_margin(*ARRIVAL, samples, rows - 1)
    assert 0.0 < expected < 1.0
    assert evaluate_now(arrivals, context) == pytest.approx(expected)
    arrivals.GetInputPort("current_cell").FixValue(context, [0.0, 0.0])
    kept = context.get_discrete_state_vector().value().copy()
    simulator.AdvanceTo(PERIOD * (rows + 3))
    assert evaluate_now(arrivals, context) == FAR
    np.testing.assert_array_equal(context.get_discrete_state_vector().value(), kept)


def evaluate_now(arrivals, context):
    return float(arrivals.GetOutputPort("arrival").Eval(context)[0])


ARRIVING = {
    "robot_state": [9.0, 9.0, 9.0, 0.1, 1.0, 2.0, 3.0, 4.0],
    "object_pose": [3.001, 2.0, 0.5],
    "current_cell": [CELLS - 1.0, 0.0],
}


@pytest.fixture
def arrivals():
    return ArrivalMonitor(ARRIVAL, CELLS, PERIOD)


@cache
def known():
    """What robot 1 is given, and what it measures at the plan's start."""
    scenario, plan = motion_under_budget()
    station = build_station(scenario)
    robot = robot_knowledge(scenario, plan, small_maps(), station.team)[1]
    context = station.diagram.CreateDefaultContext()
    plant = station.team.plant
    state = station.team.plant_state(plan.start, np.zeros(len(plan.start)))
    plant.SetPositionsAndVelocities(plant.GetMyMutableContextFromRoot(context), state)
    names = ("object_pose", "robot_1_state")
    pose, own = (np.array(station.diagram.GetOutputPort(name).Eval(context)) for name in names)
    return robot, pose, own


def inputs():
    """Inputs of a monitor whose robot rests at the plan's start; only the motion at the stamp is read."""
    robot, pose, own = known()
    nominal = np.full((3, 3, robot.plan.start.size), np.nan)
    nominal[STAMPED, 0], nominal[STAMPED, 1] = robot.plan.start, 0.0
    return {"robot_state": own, "object_pose": pose, "nominal_motion": nominal.ravel()}


def departure_monitor():
    robot = known()[0]
    joints = range(3 + robot.joints.start, 3 + robot.joints.stop)
    return DepartureMonitor(robot.monitored, joints, robot.plan.start.size)


def test_ports_and_a_robot_at_rest_on_its_motion():
    block, own = departure_monitor(), known()[0]
    axes = own.monitored.mounting.size
    assert port_sizes(block) == (
        {"robot_state": 2 * (2 + axes), "object_pose": 3, "nominal_motion": 9 * own.plan.start.size},
        {"alarm": 3},
    )
    alarm, share, _ = evaluate(block, inputs(), "alarm")
    assert alarm == 0.0
    assert share == pytest.approx(0.0, abs=1e-9)


def departures():
    """For some levels what is measured when just this departs, by its size."""
    _, pose, own = known()
    n = len(own) // 2
    unseen = known()[0].monitored.unseen
    turned = np.array([-(own[1] - pose[1]), own[0] - pose[0]])

    def moved(size):
        shift = size * np.array([0.6, -0.8])
        return {"object_pose": [*(pose[:2] + shift), pose[2]], "robot_state": [*(own[:2] + shift), *own[2:]]}

    def faster(size, away=-0.5 * unseen):
        """It comes from where it is off, so that neither position nor where it goes departs as much."""
        rates, state = own[n:] + np.array([0.6 * size, -0.8 * size, *np.zeros(n - 2)]), moved(away * size)
        return {"object_pose": state["object_pose"], "robot_state": [*state["robot_state"][:n], *rates]}

    def going(size):
        return faster(0.2 * size / unseen, 4.0 * unseen)

    def slipped(size):
        return {"robot_state": [*(own[:2] + size * np.array([0.6, -0.8])), *own[2:]]}

    def slid_round(size):
        c, s = np.cos(size), np.sin(size)
        base = pose[:2] + (own[:2] - pose[:2]) @ np.array([[c, s], [-s, c]])
        return {"object_pose": [*pose[:2], pose[2] + size], "robot_state": [*base, own[2] + size, *own[3:]]}

    def turning(size, back=0.5):
        """It comes from where it is off, as above."""
        state = slid_round(-back * unseen * size)
        rates = own[n:] + np.array([*(size * turned), size, *np.zeros(n - 3)])
        return {"object_pose": state["object_pose"], "robot_state": [*state["robot_state"][:n], *rates]}

    def turning_on(size):
        return turning(0.2 * size / unseen, -4.0)

    first = 5 + n - 2
    return {
        0: moved, 1: faster, 2: slipped, 4: going, 5: slid_round, first: turning, first + n - 2: turning_on,
    }  # fmt: skip


@pytest.mark.parametrize("check", [0, 1, 2, 4, 5, 5 + 2, 5 + 4])
def test_what_departs_is_compared_with_its_level(check):
    own = known()[0].monitored
    axes = own.mounting.size
    assert axes == 2
    level = own.levels[check] if check < 5 else own.axis_alarms.ravel()[check - 5]
    for share, alarm in ((0.9, 0.0), (1.1, 1.0), (2.1, 2.0)):
        measured = departures()[check](share * level)
        found = evaluate(departure_monitor(), inputs() | measured, "alarm")
        np.testing.assert_allclose(found, [alarm, share, check], rtol=1e-3)


def test_a_base_that_is_turned_against_its_object_and_joints_is_seen():
    own, _, state = known()[0].monitored, *known()[1:]
    for share, alarm in ((0.9, 0.0), (1.1, 1.0), (2.1, 2.0)):
        turned = state + share * own.levels[3] * np.eye(len(state))[2]
        found = evaluate(departure_monitor(), inputs() | {"robot_state": turned}, "alarm")
        np.testing.assert_allclose(found, [alarm, share, 3.0], rtol=1e-9)


def test_an_alarm_lasts_for_a_tenth_of_a_second():
    block, own, given = departure_monitor(), known()[0].monitored, inputs()
    simulator = Simulator(block, context_with(block, given))
    context, alarm = simulator.get_mutable_context(), block.GetOutputPort("alarm")
    away = given["nominal_motion"].copy()
    away.reshape(3, 3, -1)[STAMPED, 0, 0] += 1.5 * own.levels[0]
    block.GetInputPort("nominal_motion").FixValue(context, away)
    assert list(alarm.Eval(context)[:2]) == pytest.approx([1.0, 1.5], rel=1e-6)
    simulator.AdvanceTo(0.5 * own.period)
    block.GetInputPort("nominal_motion").FixValue(context, given["nominal_motion"])
    simulator.AdvanceTo(1.5 * own.period)
    assert list(alarm.Eval(context)[:2]) == pytest.approx([1.0, 0.0], abs=1e-9)
    simulator.AdvanceTo(0.11)
    assert alarm.Eval(context)[0] == 0.0


def test_a_plan_with_a_budget_has_a_monitor_without_any_key_and_needs_a_sampled_team():
    scenario, plan = motion_under_budget()
    assert known()[0].monitored is not None
    continuous, team = replace(scenario, deployment=Deployment()), build_station(scenario).team
    with pytest.raises(ScenarioError, match=r"deployment\.control_rate"):
        robot_knowledge(continuous, plan, small_maps(), team)
    free = replace(plan, departures=None, budget=None)
    assert robot_knowledge(scenario, free, small_maps(), team)[1].monitored is None
