"""A robot's monitor compares raw measurements with the nominal motion at the instant of their stamp."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from coop_drake.diagram import build_station
from coop_drake.diagram.knowledge import hold_of, robot_knowledge
from coop_drake.errors import PlanError
from coop_drake.scenario import Deployment, Hold, Measurements
from coop_drake.simulation import build_maps
from coop_drake.systems import DepartureMonitor
from tests.support.system_checks import context_with, evaluate, port_sizes
from tests.support.tubes import BUDGET, WITH_AXES, tubed_problem

NOISY = replace(WITH_AXES, grasp_noise=0.01, turn_noise=0.006)
DELAY = 2
"""Age of measurements in periods."""


@cache
def known(budget=NOISY):
    """What robot 1 is given, and what it measures at the plan's start."""
    scenario, plan = tubed_problem(budget)
    measurements = Measurements(delay=DELAY / budget.control_rate)
    deployment = Deployment(control_rate=budget.control_rate, measurements=measurements)
    scenario = replace(scenario, deployment=deployment)
    station = build_station(scenario)
    robot = robot_knowledge(scenario, plan, build_maps(plan), station.team)[1]
    context = station.diagram.CreateDefaultContext()
    plant = station.team.plant
    state = station.team.plant_state(plan.start, np.zeros(len(plan.start)))
    plant.SetPositionsAndVelocities(plant.GetMyMutableContextFromRoot(context), state)
    names = ("object_pose", "robot_1_state")
    pose, own = (np.array(station.diagram.GetOutputPort(name).Eval(context)) for name in names)
    return robot, pose, own


def inputs(budget=NOISY):
    """Inputs of a monitor whose robot rests at the plan's start."""
    _, pose, own = known(budget)
    given = {"robot_state": own, "object_pose": pose, "nominal": [*pose[:2], 0.0, 0.0, 0.0, 0.0]}
    if not budget.axes:
        return given
    axes = np.array([pose[2], *own[3 : len(own) // 2]])
    far = np.concatenate([axes - 1.0, axes + 1.0])
    return given | {
        "nominal_axes": [*axes, *np.zeros_like(axes)], "funnels": far, "current_cell": [0.0, 0.0],
    }  # fmt: skip


def monitor(budget=NOISY):
    return DepartureMonitor(known(budget)[0].monitored)


def test_ports_and_a_robot_at_rest_on_its_nominal_motion():
    block, axes = monitor(), known()[0].monitored.mounting.size
    assert port_sizes(block) == (
        {
            "robot_state": 2 * (2 + axes), "object_pose": 3, "nominal": 6, "nominal_axes": 2 * axes,
            "funnels": 2 * axes, "current_cell": 2,
        },
        {"alarm": 3},
    )  # fmt: skip
    alarm, share, _ = evaluate(block, inputs(), "alarm")
    assert alarm == 0.0
    assert share == pytest.approx(0.0, abs=1e-9)
    assert port_sizes(monitor(BUDGET))[0].keys() == {"robot_state", "object_pose", "nominal"}
    assert evaluate(monitor(BUDGET), inputs(BUDGET), "alarm")[0] == 0.0


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
        return faster(0.5 * size / unseen, unseen)

    def slipped(size):
        return {"robot_state": [*(own[:2] + size * np.array([0.6, -0.8])), *own[2:]]}

    def slid_round(size):
        c, s = np.cos(size), np.sin(size)
        base = pose[:2] + (own[:2] - pose[:2]) @ np.array([[c, s], [-s, c]])
        return {"object_pose": [*pose[:2], pose[2] + size], "robot_state": [*base, own[2] + size, *own[3:]]}

    def turning(size):
        rates = own[n:] + np.array([*(size * turned), size, *np.zeros(n - 3)])
        return {"robot_state": [*own[:n], *rates]}

    return {0: moved, 1: faster, 2: slipped, 4: going, 5: slid_round, 5 + n - 2: turning}


@pytest.mark.parametrize("check", [0, 1, 2, 4, 5, 5 + 2])
def test_what_departs_is_compared_with_its_level(check):
    own = known()[0].monitored
    axes = own.mounting.size
    assert axes == 2
    level = own.levels[check] if check < 5 else own.axis_alarms[0].ravel()[check - 5]
    for share, alarm in ((0.9, 0.0), (1.1, 1.0), (2.1, 2.0)):
        measured = departures()[check](share * level)
        found = evaluate(monitor(), inputs() | measured, "alarm")
        np.testing.assert_allclose(found, [alarm, share, check], rtol=1e-3)


def test_a_base_that_is_turned_against_its_object_and_joints_is_seen():
    own, _, state = known()[0].monitored, *known()[1:]
    for share, alarm in ((0.9, 0.0), (1.1, 1.0), (2.1, 2.0)):
        turned = state + share * own.levels[3] * np.eye(len(state))[2]
        found = evaluate(monitor(), inputs() | {"robot_state": turned}, "alarm")
        np.testing.assert_allclose(found, [alarm, share, 3.0], rtol=1e-9)


def test_an_axis_near_a_bound_of_its_funnel_has_the_level_that_its_room_leaves():
    own, given = known()[0].monitored, inputs()
    axes = np.array(given["nominal_axes"][:2])
    reserve, alarm = own.axis_reserve[1], own.axis_alarms[0, 0, 1]
    near = np.array([axes[0] - 1.0, axes[1] - 1.0, axes[0] + 1.0, axes[1] + reserve + 0.5 * alarm])
    block, moved = monitor(), np.array([axes[0], axes[1] - 0.25 * alarm, 0.0, 0.0])
    simulator = Simulator(block, context_with(block, given | {"funnels": near, "nominal_axes": moved}))
    simulator.AdvanceTo((DELAY + 0.5) * own.period)
    alarm_now, share, which = block.GetOutputPort("alarm").Eval(simulator.get_context())
    assert (alarm_now, which) == (0.0, 6.0)
    assert share == pytest.approx(0.25 / 0.75, rel=1e-6)


def test_measurements_are_compared_with_the_nominal_state_of_their_stamp():
    block, own, given = monitor(), known()[0].monitored, inputs()
    simulator = Simulator(block, context_with(block, given))
    context, alarm = simulator.get_mutable_context(), block.GetOutputPort("alarm")
    simulator.AdvanceTo(3.5 * own.period)
    away = [given["nominal"][0] + 2.5 * own.levels[0], *given["nominal"][1:]]
    block.GetInputPort("nominal").FixValue(context, away)
    for periods, expected in ((3.6, 0.0), (4.5, 0.0), (5.5, 2.5)):  # measurements are two periods old
        simulator.AdvanceTo(periods * own.period)
        assert alarm.Eval(context)[1] == pytest.approx(expected, abs=1e-9)
    block.GetInputPort("nominal").FixValue(context, given["nominal"])
    simulator.AdvanceTo(7.5 * own.period)
    assert list(alarm.Eval(context)[:2]) == pytest.approx(
        [1.0, 0.0], abs=1e-9
    )  # it was above its level just now
    simulator.AdvanceTo(7.5 * own.period + 0.11)
    assert alarm.Eval(context)[0] == 0.0


def test_a_plan_with_a_budget_has_a_monitor_without_any_key_and_none_is_followed_without_levels():
    scenario, plan = tubed_problem(NOISY)
    assert hold_of(scenario, plan) == Hold()
    assert hold_of(scenario, replace(plan, alarms=None)) is None
    scenario, team = (
        replace(scenario, deployment=Deployment(control_rate=200.0)),
        build_station(scenario).team,
    )
    with pytest.raises(PlanError, match="no alarm levels"):
        robot_knowledge(scenario, replace(plan, alarms=None), build_maps(plan), team)
