"""Quick turns: centrifugal forces, known late and with wrong masses, throw bent arms; budgets count them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from shapely import box

from coop_drake.answers import Undecided
from coop_drake.answers.plan import Cell
from coop_drake.errors import RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan as make
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import budget_of
from coop_drake.scenario import Deployment, Goal, ObjectPose, Start
from coop_drake.simulation import build_maps, simulate
from coop_drake.typed_data import convert_class
from coop_drake.verification.runs.budget import check_budget_used
from coop_drake.verification.runs.rows import Rows
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
