"""Quick turns, whose centrifugal forces budgets count, and runs within a budget of the axes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from shapely import box

from coop_drake.answers import Undecided
from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Cell
from coop_drake.cli.summary import beyond_budget, budget_facts
from coop_drake.errors import RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan as make
from coop_drake.plant import planning_problem, run_setup
from coop_drake.plant.facts import budget_of
from coop_drake.scenario import ActuatorLimits, Deployment, Goal, Measurements, Messages, ObjectPose, Start
from coop_drake.simulation import build_maps, simulate
from coop_drake.typed_data import convert_class
from coop_drake.verification.budget import check_budget
from coop_drake.verification.runs import verify_log
from coop_drake.verification.runs.budget import check_budget_used
from coop_drake.verification.runs.laws import check_handovers, rest_shares
from coop_drake.verification.runs.rows import Rows
from tests.support.run_checks import verified_run
from tests.support.small_loop import joint_names
from tests.support.small_plan import START_POSE, plan_by_hand
from tests.support.small_scenario import small_scenario

ARMS = {"robot_0": (-0.05, 0.22), "robot_1": (0.45, -0.95)}
"""The second robot's arm is bent as in the cell of `elbow` in which the object turns quickest."""

TURN = 1.3
"""How far the object turns [rad]."""


QUIET = {"angle_noise": 0.0002, "rate_noise": 0.004}
"""With the noise of the preset, monitors have no room at goals of joints within 0.02 rad [rad, rad/s]."""


def deployed(**changes):
    return convert_class(Deployment.completed({"preset": "mobile_base", **changes}), Deployment)


def asked(**measurements):
    """A scenario with a quick turn, its question, and the budget of the preset with other measurements."""
    scenario = small_scenario("elbow")
    pose = scenario.start.object
    goal = ObjectPose(pose.x + 0.2, pose.y, pose.theta + TURN)
    deployment = deployed(actuators={"base_force": None}, measurements=measurements)
    scenario = replace(
        scenario, deployment=deployment, start=Start(pose, ARMS), limits={},
        goal=Goal(goal, ARMS, scenario.goal.tolerances),
    )  # fmt: skip
    gains = ScheduledGains().for_age(deployment.command_age)
    scenario = replace(scenario, gains=replace(scenario.gains, sets={"scheduled": gains}))
    problem = planning_problem(scenario)
    return scenario, problem, gains, budget_of("all", scenario, problem)


@cache
def planned(counted=True):
    scenario, problem, gains, budget = asked(**QUIET)
    if not counted:
        budget = replace(budget, bodies=(), rotors=())
    plan = make(problem, gains, gain_set_name="scheduled", budget=budget).plan
    return scenario, plan, build_maps(plan)


def run_planned(mass_error, counted=True):
    scenario, plan, maps = planned(counted)
    deployment = replace(scenario.deployment, mass_error=mass_error)
    return plan, simulate(replace(scenario, deployment=deployment), plan, maps)


def spared(plan, log):
    """By how much every axis kept more than the stated distance from its bounds, least, shape (axes,)."""
    axes = np.column_stack([log.object_pose[:, 2], log.joints])
    stated = np.array([one.tolerance.distance for one in plan.transitions])[log.cell_index]
    kept = np.minimum(axes - log.funnel_lower, log.funnel_upper - axes)
    return (kept - stated).min(axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("mass_error", [-0.2, 0.2])
def test_axes_keep_the_stated_distances_in_a_quick_turn(mass_error):
    plan, log = run_planned(mass_error)
    assert (log.reached, log.violation) == (True, "")
    assert np.abs(log.object_twist[:, 2]).max() > 0.95  # masses wrong by a fifth then leave 2 rad/s^2 of c
    assert max(check.tightest for check in check_budget_used(Rows(log, plan))) < 1.0
    assert spared(plan, log).min() > 0.0


def test_without_rate_terms_axes_come_nearer_to_their_bounds_than_stated():
    plan, log = run_planned(-0.2, counted=False)
    assert spared(plan, log).min() < -0.01
    with pytest.raises(RefusalError, match="nearer to a bound of its funnel than stated"):
        check_budget_used(Rows(log, plan))


@pytest.mark.slow
def test_with_the_noise_of_the_preset_the_monitors_have_no_room():
    _, problem, gains, budget = asked()
    answer = make(problem, gains, gain_set_name="scheduled", budget=budget)
    assert isinstance(answer, Undecided)
    assert "may leave its funnel before its monitor sees it" in answer.reason


HALF_WIDTH = 0.03


def turning_plan(names, gain_set):
    """Two turns of 0.6 rad in one place, with 60 mrad for every joint."""
    room, arms = box(2.0, 2.0, 4.4, 4.4), np.concatenate([*ARMS.values()])
    cells = tuple(
        Cell(np.array([lower, *(arms - HALF_WIDTH)]), np.array([upper, *(arms + HALF_WIDTH)]), room)
        for lower, upper in ((-0.46, 0.26), (-1.12, -0.40))
    )
    start = np.array([*START_POSE, *arms])
    return plan_by_hand(cells, start, np.array([3.2, 3.2, -1.04]), names, gain_set)


@cache
def maps():
    return build_maps(turning_plan(("a", "b", "c", "d"), ScheduledGains()))


def turned(mass_error, **rule):
    deployment, scenario = deployed(mass_error=mass_error), small_scenario("elbow")
    gains = ScheduledGains(**rule).for_age(deployment.command_age)
    plan = turning_plan(joint_names(scenario), gains)
    start = Start(scenario.start.object, ARMS)
    return simulate(replace(scenario, start=start, deployment=deployment), plan, maps())


@pytest.mark.parametrize("mass_error", [-0.2, 0.2])
def test_a_turn_as_quick_as_joints_bear_arrives(mass_error):
    log = turned(mass_error)
    assert (log.reached, log.violation) == (True, "")
    assert log.funnel_margin.min() > 0.002


def test_a_quicker_turn_is_lost():
    assert "robot_1::shoulder to its funnel" in turned(-0.2, turning_acceleration=1e3).violation


# A team within a budget for angles and joints keeps, in Drake's loop, what the plan states about them.


DEVIATIONS = 4.5
"""Bounds of noise over the standard deviations in the run: one sample in 150,000 is beyond, none here."""

BUDGET = Budget(
    control_rate=200.0, delay=0.01, lag=0.005, angle_noise=0.0005, rate_noise=0.01, position_noise=0.001,
    velocity_noise=0.02, single_noise=1.5, model_error=0.1, acceleration_error=0.2, report_age=0.03,
)  # fmt: skip


@cache
def run():
    scenario = small_scenario()
    goal = replace(scenario.goal, joints={"robot_0": (0.4,), "robot_1": (-0.3,)})
    noise = [bound / DEVIATIONS for bound in (BUDGET.position_noise, BUDGET.angle_noise, BUDGET.rate_noise)]
    deployment = Deployment(
        control_rate=BUDGET.control_rate,
        mass_error=BUDGET.model_error,
        measurements=Measurements(*noise, delay=BUDGET.delay),
        actuators=ActuatorLimits(lag=BUDGET.lag),
        messages=Messages(loss=0.2),
    )
    scenario = replace(scenario, goal=goal, limits={}, deployment=deployment)
    gains = ScheduledGains().for_age(deployment.command_age)
    scenario = replace(scenario, gains=replace(scenario.gains, sets={"scheduled": gains}))
    plan = make(planning_problem(scenario), gains, gain_set_name="scheduled", budget=BUDGET).plan
    return scenario, plan, simulate(scenario, plan, build_maps(plan))


def test_the_run_arrives_and_is_accepted_within_its_budget():
    scenario, plan, log = run()
    assert plan.budget == BUDGET
    assert check_budget(plan).count == len(plan.cells) * (1 + len(plan.joint_names))
    assert (log.reached, log.violation) == (True, "")
    checks = {check.name: check for check in verified_run(scenario, plan, log).checks}
    assert 0.01 < checks["the object stayed in the tube of its budget"].tightest < 1.0
    for name in (
        "its velocity stayed as near to the nominal one",
        "axes kept the distances that the budget states",
        "axes stayed in the tubes of their budget",
        "their rates stayed as near to the nominal ones",
    ):
        assert 0.01 < checks[name].tightest < 1.0


def test_no_axis_used_more_than_what_is_stated_of_it():
    """Distances to bounds are within the sets of the plan."""
    _, plan, log = run()
    gaps = np.minimum(log.joints - log.funnel_lower[:, 1:], log.funnel_upper[:, 1:] - log.joints)
    for k, transition in enumerate(plan.transitions):
        members, stated = log.cell_index == k, transition.tolerance
        assert (gaps[members].min(axis=0) >= stated.distance[1:]).all()


def test_cells_are_left_at_rest_and_one_that_is_left_unready_or_earlier_is_refused():
    scenario, plan, log = run()
    left = np.flatnonzero(np.diff(log.cell_index))
    assert len(left) == len(plan.cells) - 1 > 0
    for k, row in enumerate(left):
        rates = np.concatenate((log.object_twist[row + 1, 2:], log.joint_rates[row + 1]))
        axes = np.concatenate((log.object_pose[row + 1, 2:], log.joints[row + 1]))
        assert rest_shares(plan, k, axes, rates).max() <= 1.0
        assert (
            log.transition_start[row + 1] - log.transition_start[row] >= plan.transitions[k].gains.rest.after
        )
    never = replace(log, ready_margins=np.where(log.cell_index[:, None] == 0, -0.1, log.ready_margins))
    with pytest.raises(RefusalError, match="all before in cell 0 are negative, but the cell is left"):
        verify_log(never, plan, planning_problem(scenario), run_setup(scenario))
    cells = log.cell_index.copy()
    cells[left[0] - 20 : left[0] + 1] += 1
    with pytest.raises(RefusalError, match=r"transition_start\[\d+\]"):
        check_handovers(Rows(replace(log, cell_index=cells), plan), exact=False)


def test_a_stated_departure_that_is_exceeded_in_the_world_is_said_and_its_log_refused():
    _, plan, log = run()
    within = budget_facts(plan, log)
    assert 0.01 < within["budget_used"] < 1.0
    assert beyond_budget(within) == ""
    row = len(log.times) // 2
    stated = plan.transitions[log.cell_index[row]].tolerance.rate_departure
    for array, column, away, what in (
        ("object_pose", 1, plan.tube.radius, "the object's position"),
        ("object_twist", 0, plan.tube.rate, "the object's velocity"),
        ("joint_rates", 1, stated[2], "the rate of robot_1::elbow"),
    ):
        moved = getattr(log, array).copy()
        moved[row, column] += 1.9 * away
        departed = replace(log, **{array: moved})
        said = beyond_budget(budget_facts(plan, departed))
        assert said.startswith((f"{what} departed by 1.", f"{what} departed by 2."))
        assert said.endswith(f"times what the plan's budget states, at t = {log.times[row]:.6g} s")
        assert beyond_budget(budget_facts(plan, departed, until=log.times[row])) == ""
        with pytest.raises(RefusalError, match="from its nominal motion; the plan's budget states"):
            check_budget_used(Rows(departed, plan))


def test_a_log_with_an_axis_nearer_to_a_bound_than_stated_is_refused():
    _, plan, log = run()
    closest = replace(
        plan,
        transitions=tuple(
            replace(one, tolerance=replace(one.tolerance, distance=one.tolerance.distance + 0.02))
            for one in plan.transitions
        ),
    )
    with pytest.raises(RefusalError, match="nearer to a bound of its funnel than stated"):
        check_budget_used(Rows(log, closest))
