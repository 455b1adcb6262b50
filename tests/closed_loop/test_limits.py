"""Transports keep the limits of speed, acceleration and effort of bases and joints; plans state them."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers import BeyondLimits, save_plan
from coop_drake.answers.problem import TeamLimits
from coop_drake.answers.speeds import peak_speeds
from coop_drake.errors import RefusalError
from coop_drake.laws import FixedGains, ScheduledGains
from coop_drake.planning.duration import estimated
from coop_drake.planning.planner import plan as make
from coop_drake.planning.transitions import reschedule
from coop_drake.plant import planning_problem, run_setup
from coop_drake.scenario import Deployment, Measurements
from coop_drake.scenario.model import RobotLimits
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification import verify_file
from coop_drake.verification.gains import check_accelerations, check_limits, check_speeds
from coop_drake.verification.runs import verify_log
from coop_drake.verification.runs.bodies import check_run_efforts
from coop_drake.verification.runs.rows import Rows
from tests.support.run_checks import verified_run
from tests.support.small_scenario import small_scenario

LIMITS = {
    "slow bases": {"*": RobotLimits(base_speed=0.5)},
    "slow joints": {"*": RobotLimits(joint_rates=(0.05,))},
    "all of one robot": {"robot_1": RobotLimits(base_speed=0.4, base_turn_rate=0.2, joint_rates=(0.1,))},
    "none": {},
}
SLOWLY = {"robot_0": RobotLimits(joint_accelerations=(2.0,)), "robot_1": RobotLimits()}


def accelerating(limit):
    return {"*": RobotLimits(joint_accelerations=(limit,))}


def limited(limits, **changes):
    scenario = small_scenario()
    goal = replace(scenario.goal, joints={"robot_0": (0.4,), "robot_1": (-0.3,)})
    return replace(scenario, goal=goal, limits=limits, **changes)


def planned(problem, gains=None):
    return make(problem, gains or ScheduledGains(), gain_set_name="scheduled").plan


def run_of(scenario):
    problem = planning_problem(scenario)
    plan = planned(problem, scenario.gain_sets["scheduled"])
    return scenario, problem, plan, simulate(scenario, plan, build_maps(plan))


@pytest.fixture(scope="module", params=LIMITS)
def case(request):
    return run_of(limited(LIMITS[request.param]))


@pytest.fixture(scope="module")
def accelerated():
    return run_of(limited(SLOWLY))


def speeds(log):
    """Mean speeds of the bases from row to row, (T, N), and their turn rates."""
    steps = np.diff(log.times)
    moved = np.diff(log.base_poses, axis=0)[steps > 1e-4] / steps[steps > 1e-4][:, None, None]
    turned = np.diff(np.unwrap(log.base_poses[..., 2], axis=0), axis=0)[steps > 1e-4]
    return np.hypot(moved[..., 0], moved[..., 1]), np.abs(turned) / steps[steps > 1e-4][:, None]


@pytest.mark.slow
def test_the_transport_arrives_keeps_every_limit_and_takes_the_estimated_time(case):
    _, problem, plan, log = case
    assert log.reached, log.violation
    assert sum(t.estimated_time for t in plan.transitions) == pytest.approx(log.times[-1], rel=0.1)
    limits, (bases, turns) = problem.limits, speeds(log)
    assert (bases.max(axis=0) <= limits.base_speeds).all()
    assert (turns.max(axis=0) <= limits.turn_rates).all()
    assert (np.abs(log.joint_rates).max(axis=0) <= limits.joint_rates).all()
    if limits.any:
        assert (bases.max(axis=0) <= plan.speeds.base_speeds).all()
        own = plan.transitions[0].gains.rate_limit[1:]
        assert (np.abs(log.joint_rates).max(axis=0) <= own * (1.0 + 1e-9)).all()
    else:
        assert plan.speeds is None
        assert bases.max() > 0.8
        assert np.abs(log.joint_rates).max() > 0.3


def test_plan_and_run_are_verified(case, tmp_path):
    scenario, problem, plan, log = case
    verified = verify_file(save_plan(plan, tmp_path / "plan.json"), problem, scenario.gain_sets)
    named = [check.name for check in verified.checks]
    assert ("limits of speed are kept by the gains" in named) == problem.limits.any
    kept = [c for c in verified_run(scenario, plan, log).checks if "limits of speed" in c.name]
    assert len(kept) == problem.limits.any
    assert all(check.tightest > 0.0 for check in kept)


def test_limits_of_speed_that_are_left_out_made_up_or_exceeded_are_refused(case):
    scenario, problem, plan, log = case
    made_up = planning_problem(replace(scenario, limits={"*": RobotLimits(base_speed=0.45)}))
    with pytest.raises(RefusalError):
        check_speeds(plan, replace(problem, limits=made_up.limits))
    if problem.limits.any:
        with pytest.raises(RefusalError, match="missing"):
            check_speeds(replace(plan, speeds=None), problem)
        with pytest.raises(RefusalError, match="neither models nor scenario"):
            check_speeds(plan, replace(problem, limits=TeamLimits()))
    fastest = np.abs(log.joint_rates).max(axis=0)
    slower = replace(problem, limits=replace(problem.limits, joint_rates=0.99 * fastest))
    with pytest.raises(RefusalError, match=r"joint_rates\[\d+, [01]\].* the limit is"):
        verify_log(log, plan, slower, run_setup(scenario))


@pytest.mark.slow
def test_sampled_and_noisy_teams_keep_their_limits():
    noise = Measurements(0.001, 0.0005, 0.01, 0.01)
    deployment = Deployment(control_rate=200.0, mass_error=0.2, measurements=noise)
    log = run_of(limited(LIMITS["slow bases"], deployment=deployment))[3]
    assert log.reached, log.violation
    assert speeds(log)[0].max() <= 0.5


def test_a_run_keeps_the_limit_of_acceleration_that_it_would_exceed_without_one(accelerated):
    scenario, problem, plan, log = accelerated
    assert log.reached, log.violation
    assert problem.limits.joint_accelerations.tolist() == [2.0, np.inf]
    largest = np.abs(log.accelerations[:, 3:]).max(axis=0)
    free = estimated(planned(planning_problem(limited({}))))[2].max(axis=0)
    assert largest[0] < 1.9 < 3.0 < free[1]
    assert largest == pytest.approx(estimated(plan)[2].max(axis=0)[1:], rel=0.1)
    names = [check.name for check in verified_run(scenario, plan, log).checks]
    assert "joints kept their limits of acceleration" in names
    peaks = {one.name: one for one in peak_speeds(log, problem)}
    assert peaks["acceleration of robot_0::elbow"].limit == 2.0
    assert "acceleration of robot_1::elbow" not in peaks


@pytest.mark.parametrize("limit", [5.0, 0.5])
def test_gains_are_slowed_until_no_limit_of_acceleration_acts(limit):
    plan = planned(planning_problem(limited(accelerating(limit))))
    assert (plan.age_factor > 1.0) == (limit < 1.0)
    assert estimated(plan)[2][:, 1:].max() < 0.95 * limit
    assert repr(reschedule(plan, ScheduledGains(), "scheduled")) == repr(plan)


def test_a_limit_of_acceleration_that_no_gains_keep_is_named():
    problem = planning_problem(limited(accelerating(0.2)))
    refused = make(problem, FixedGains(), gain_set_name="table_2")
    assert isinstance(refused, BeyondLimits)
    (limit,) = refused.plan.refused_by
    assert (limit.limit, limit.allowed) == ("limits.joint_accelerations", 0.2)
    assert limit.value > 10.0 * limit.allowed
    assert (limit.unit, limit.joint) in {("rad/s^2", joint.name) for joint in problem.tree.joints}
    assert f"{limit.joint} is accelerated by" in refused.reason
    assert check_limits(refused.plan, problem, FixedGains())[-1].count == 1
    for change in (
        {"unit": "m/s^2"},
        {"joint": "object::lid"},
        {"allowed": 0.1},
        {"value": 1.01 * limit.value},
    ):
        altered = replace(refused.plan, refused_by=(replace(limit, **change),))
        with pytest.raises(RefusalError, match=r"refused_by\[0\]"):
            check_limits(altered, problem, FixedGains())
    with pytest.raises(RefusalError, match=r"refused_by: does not say .* limits\.joint_accel"):
        check_limits(replace(refused.plan, refused_by=()), problem, FixedGains())


def test_limits_of_acceleration_or_effort_that_are_missing_made_up_or_exceeded_are_refused(accelerated):
    _, problem, plan, log = accelerated
    with pytest.raises(RefusalError, match="neither models nor scenario"):
        check_accelerations(plan, replace(problem, limits=TeamLimits()))
    with pytest.raises(RefusalError, match="missing"):
        check_accelerations(planned(planning_problem(limited({}))), problem)
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
