"""Transports keep the limits of speed of bases and joints; plans state them and are refused if altered."""

import json
from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers import save_plan
from coop_drake.answers.limits import TeamLimits
from coop_drake.errors import PlanError, RefusalError
from coop_drake.planning.planner import plan as make
from coop_drake.plant import planning_problem, run_setup
from coop_drake.scenario import Deployment, Measurements
from coop_drake.scenario.model import RobotLimits
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification import verify_file
from coop_drake.verification.gains import check_speeds
from coop_drake.verification.runs import verify_log
from tests.support.certificates import changed, write
from tests.support.run_checks import verified_run
from tests.support.small_scenario import small_scenario

LIMITS = {
    "slow bases": {"*": RobotLimits(base_speed=0.5)},
    "slow joints": {"*": RobotLimits(joint_rates=(0.05,))},
    "all of one robot": {"robot_1": RobotLimits(base_speed=0.4, base_turn_rate=0.2, joint_rates=(0.1,))},
}


def limited(name, **changes):
    scenario = small_scenario()
    goal = replace(scenario.goal, joints={"robot_0": (0.4,), "robot_1": (-0.3,)})
    return replace(scenario, goal=goal, limits=LIMITS.get(name, {}), **changes)


def planned(scenario):
    gains = scenario.gain_sets["scheduled"]
    return make(planning_problem(scenario), gains, gain_set_name="scheduled").plan


@pytest.fixture(scope="module", params=[*LIMITS, "none"])
def case(request):
    scenario = limited(request.param)
    plan = planned(scenario)
    return scenario, plan, simulate(scenario, plan, build_maps(plan))


def speeds(log):
    """Mean speeds of the bases from row to row, (T, N), and their turn rates."""
    steps = np.diff(log.times)
    moved = np.diff(log.base_poses, axis=0)[steps > 1e-4] / steps[steps > 1e-4][:, None, None]
    turned = np.diff(np.unwrap(log.base_poses[..., 2], axis=0), axis=0)[steps > 1e-4]
    return np.hypot(moved[..., 0], moved[..., 1]), np.abs(turned) / steps[steps > 1e-4][:, None]


@pytest.mark.slow
def test_the_transport_arrives_and_keeps_every_limit(case):
    scenario, plan, log = case
    assert log.reached, log.violation
    limits = planning_problem(scenario).limits
    bases, turns = speeds(log)
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


def test_the_estimate_is_that_of_the_limited_transport(case):
    _, plan, log = case
    assert sum(t.estimated_time for t in plan.transitions) == pytest.approx(log.times[-1], rel=0.1)


def test_plan_and_run_are_verified(case, tmp_path):
    scenario, plan, log = case
    problem = planning_problem(scenario)
    verified = verify_file(save_plan(plan, tmp_path / "plan.json"), problem, scenario.gain_sets)
    named = [check.name for check in verified.checks]
    assert ("limits of speed are kept by the gains" in named) == problem.limits.any
    kept = [c for c in verified_run(scenario, plan, log).checks if "limits of speed" in c.name]
    assert len(kept) == problem.limits.any
    assert all(check.tightest > 0.0 for check in kept)


def test_named_blocks_keep_the_same_limits(case):
    scenario, plan, log = case
    if scenario.limits != LIMITS["all of one robot"]:
        return
    named = simulate(scenario, plan, build_maps(plan))
    assert named.times[-1] == pytest.approx(log.times[-1], abs=1e-6)
    np.testing.assert_allclose(named.joint_rates[-1], log.joint_rates[-1], atol=1e-8)


@pytest.mark.slow
def test_altered_numbers_are_refused(case, tmp_path):
    scenario, plan, _ = case
    problem = planning_problem(scenario)
    document = json.loads(save_plan(plan, tmp_path / "plan.json").read_text())
    ways = [(k, i) for k, values in document.get("speeds", {}).items() for i in range(len(values))]
    places = [("speeds", *way) for way in ways]
    for k in (0, len(plan.transitions) - 1):
        places += [("transitions", k, "gains", "rate_limit", i) for i in range(3) if ways]
        places += [("transitions", k, "gains", "speed_limit")] * ("speed_limit" in document["transitions"][k])
    for place in places:
        value = document
        for step in place:
            value = value[step]
        for other in (0.3, 7.0) if value is None else (1.01 * value, 0.99 * value, None, -value):
            altered = write(changed(document, place, other), tmp_path / "altered.json", signed=True)
            with pytest.raises((RefusalError, PlanError)):
                verify_file(altered, problem, scenario.gain_sets)


def test_limits_that_are_left_out_or_made_up_are_refused(case, tmp_path):
    scenario, plan, _ = case
    problem = planning_problem(scenario)
    made_up = planning_problem(replace(scenario, limits={"*": RobotLimits(base_speed=0.45)}))
    with pytest.raises(RefusalError):
        check_speeds(plan, replace(problem, limits=made_up.limits))
    if problem.limits.any:
        with pytest.raises(RefusalError, match="missing"):
            check_speeds(replace(plan, speeds=None), problem)
        with pytest.raises(RefusalError, match="neither models nor scenario"):
            check_speeds(plan, replace(problem, limits=TeamLimits()))


def test_a_run_that_was_faster_than_its_limits_is_refused(case):
    scenario, plan, log = case
    problem = planning_problem(scenario)
    fastest = np.abs(log.joint_rates).max(axis=0)
    slower = replace(problem, limits=replace(problem.limits, joint_rates=0.99 * fastest))
    with pytest.raises(RefusalError, match=r"joint_rates\[\d+, [01]\].* the limit is"):
        verify_log(log, plan, slower, run_setup(scenario))


@pytest.mark.slow
def test_sampled_and_noisy_teams_keep_their_limits():
    scenario = limited(
        "slow bases",
        deployment=Deployment(
            control_rate=200.0, mass_error=0.2, measurements=Measurements(0.001, 0.0005, 0.01, 0.01)
        ),
    )
    plan = planned(scenario)
    log = simulate(scenario, plan, build_maps(plan))
    assert log.reached, log.violation
    assert speeds(log)[0].max() <= 0.5
