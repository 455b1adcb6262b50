"""Transports keep the limits of acceleration and of effort of joints; altered plans and logs are refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers import BeyondLimits, save_plan
from coop_drake.answers.limits import TeamLimits
from coop_drake.answers.speeds import peak_speeds
from coop_drake.errors import PlanError, RefusalError
from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.planning.duration import estimated
from coop_drake.planning.limits import planned_accelerations
from coop_drake.planning.planner import plan as make
from coop_drake.planning.transitions import reschedule
from coop_drake.plant import planning_problem, run_setup
from coop_drake.scenario.model import RobotLimits
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification import verify_file
from coop_drake.verification.gains import check_accelerations, check_limits
from coop_drake.verification.runs import verify_log
from coop_drake.verification.runs.mechanics import check_run_efforts
from coop_drake.verification.runs.rows import Rows
from tests.support.certificates import changed, write
from tests.support.small_scenario import small_scenario

LIMITS = {"robot_0": RobotLimits(joint_accelerations=(2.0,)), "robot_1": RobotLimits()}


def limited(limits=LIMITS):
    scenario = small_scenario()
    goal = replace(scenario.goal, joints={"robot_0": (0.4,), "robot_1": (-0.3,)})
    return replace(scenario, goal=goal, limits=limits)


def planned(problem, gains=None):
    return make(problem, gains or ScheduledGains(), gain_set_name="scheduled").plan


@pytest.fixture(scope="module")
def run():
    scenario = limited()
    problem = planning_problem(scenario)
    plan = planned(problem)
    return scenario, problem, plan, simulate(scenario, plan, build_maps(plan))


def test_a_run_keeps_the_limit_that_it_would_exceed_without_one(run):
    scenario, problem, plan, log = run
    assert log.reached, log.violation
    assert problem.limits.joint_accelerations.tolist() == [2.0, np.inf]
    largest = np.abs(log.accelerations[:, 3:]).max(axis=0)
    free = estimated(planned(planning_problem(limited({}))))[2].max(axis=0)
    assert largest[0] < 1.9 < 3.0 < free[1]
    assert largest == pytest.approx(estimated(plan)[2].max(axis=0)[1:], rel=0.1)
    names = [check.name for check in verify_log(log, plan, problem, run_setup(scenario)).checks]
    assert "joints kept their limits of acceleration" in names
    peaks = {one.name: one for one in peak_speeds(log, problem)}
    assert peaks["acceleration of robot_0::elbow"].limit == 2.0
    assert "acceleration of robot_1::elbow" not in peaks


@pytest.mark.parametrize("limit", [5.0, 0.5])
def test_gains_are_slowed_until_no_limit_acts(limit):
    problem = planning_problem(limited({"*": RobotLimits(joint_accelerations=(limit,))}))
    plan = planned(problem)
    assert (plan.age_factor > 1.0) == (limit < 1.0)
    assert estimated(plan)[2][:, 1:].max() < 0.95 * limit
    assert repr(reschedule(plan, ScheduledGains(), "scheduled")) == repr(plan)


def test_a_limit_that_no_gains_keep_is_named():
    problem = planning_problem(limited({"*": RobotLimits(joint_accelerations=(0.2,))}))
    refused = make(problem, FixedGains(), gain_set_name="table_2")
    assert isinstance(refused, BeyondLimits)
    (limit,) = refused.plan.refused_by
    assert (limit.limit, limit.allowed) == ("limits.joint_accelerations", 0.2)
    assert limit.value > 10.0 * limit.allowed
    assert (limit.unit, limit.joint) in {("rad/s^2", joint.name) for joint in problem.tree.joints}
    assert f"{limit.joint} is accelerated by" in refused.reason
    assert check_limits(refused.plan, problem, FixedGains())[-1].count == 1
    changes = {"unit": "m/s^2"}, {"joint": "object::lid"}, {"allowed": 0.1}, {"value": 1.01 * limit.value}
    for change in changes:
        altered = replace(refused.plan, refused_by=(replace(limit, **change),))
        with pytest.raises(RefusalError, match=r"refused_by\[0\]"):
            check_limits(altered, problem, FixedGains())
    with pytest.raises(RefusalError, match=r"refused_by: does not say .* limits\.joint_accel"):
        check_limits(replace(refused.plan, refused_by=()), problem, FixedGains())


def test_altered_limits_are_refused(run, tmp_path):
    scenario, problem, plan, _ = run
    path = save_plan(plan, tmp_path / "plan.json")
    names = [check.name for check in verify_file(path, problem, scenario.gain_sets).checks]
    assert "limits of acceleration are kept by the commands" in names
    document = json.loads(path.read_text())
    last = len(plan.transitions) - 1
    for place, values in (
        (("age_factor",), (1.01, 0.99, None, 0.0)),
        (("transitions", last, "gains", "acceleration_limit", 1), (1.8, 2.1, None, -1.0)),
        (("transitions", 0, "gains", "acceleration_limit"), (None, [None], [None, 1.9])),
    ):
        for value in values:
            altered = write(changed(document, place, value), tmp_path / "altered.json", signed=True)
            with pytest.raises((RefusalError, PlanError)):
                verify_file(altered, problem, scenario.gain_sets)


def test_limits_that_are_missing_or_made_up_are_refused(run):
    _, problem, plan, _ = run
    with pytest.raises(RefusalError, match="neither models nor scenario"):
        check_accelerations(plan, replace(problem, limits=TeamLimits()))
    with pytest.raises(RefusalError, match="missing"):
        check_accelerations(planned(planning_problem(limited({}))), problem)
    assert planned_accelerations(TeamLimits()) is None


def test_a_run_beyond_a_limit_of_acceleration_or_effort_is_refused(run):
    _, problem, plan, log = run
    rows = Rows(log, plan)
    for key, array, values in (
        ("joint_accelerations", r"accelerations\[\d+, 3\]", log.accelerations[:, 3:]),
        ("joint_efforts", r"joint_torques\[\d+, 0\]", log.joint_torques),
    ):
        largest = np.abs(values).max(axis=0)
        kept = replace(problem, limits=replace(problem.limits, **{key: 1.01 * largest}))
        assert min(check.tightest for check in check_run_efforts(rows, kept)) > 0.0
        less = replace(problem, limits=replace(problem.limits, **{key: largest * [0.99, np.inf]}))
        with pytest.raises(RefusalError, match=array + ".* times the limit of the joint's"):
            check_run_efforts(rows, less)
