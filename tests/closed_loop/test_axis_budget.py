"""A team within a budget for angles and joints keeps, in Drake's loop, what the plan states about them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from coop_drake.answers.budget import Budget
from coop_drake.cli.summary import beyond_budget, budget_facts
from coop_drake.errors import RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan as make
from coop_drake.plant import planning_problem, run_setup
from coop_drake.scenario import ActuatorLimits, Deployment, Measurements, Messages
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification.budget import check_budget
from coop_drake.verification.runs import verify_log
from coop_drake.verification.runs.budget import check_budget_used
from coop_drake.verification.runs.laws import check_handovers, rest_shares
from coop_drake.verification.runs.rows import Rows
from tests.support.run_checks import verified_run
from tests.support.small_scenario import small_scenario

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
