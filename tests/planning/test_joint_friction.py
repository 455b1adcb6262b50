"""Friction of joints in a budget: what it accelerates, what a plan states, and runs with more of it."""

from dataclasses import replace

import numpy as np
import pytest

from coop_drake.answers import Found
from coop_drake.answers.budget import Budget
from coop_drake.cli.task import read_task
from coop_drake.compiled_loop import prepare, run
from coop_drake.errors import RefusalError, ScenarioError
from coop_drake.laws.team_dynamics import team_accelerations, team_chain, team_work
from coop_drake.planning.budget.axis_proofs import UnprovedTransition
from coop_drake.planning.budget.fitting import fit_budget
from coop_drake.planning.planner import plan
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import budget_of, scenario_budgets
from coop_drake.robustness.axis_departure import axis_loop
from coop_drake.scenario import Deployment, JointFriction, load_scenario
from coop_drake.simulation import build_maps
from coop_drake.typed_data import DataError, convert_class
from coop_drake.verification import verify_plan
from tests.support.scenarios import MODELS, write_scenario

FRICTION = {"coulomb": 0.12, "viscous": 0.02}


GOAL = {
    "object": {"x": 3.2, "y": 2.2, "theta": 0.1},
    "joints": {"robot_0": [0.5], "robot_1": [-0.4]},
}


def preset(friction, **others):
    return {"preset": "mobile_base", "budget": "all", "joint_friction": friction, **others}


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory):
    """A room with a budget that has friction, and its plan."""
    path = tmp_path_factory.mktemp("room") / "room.scenario.yaml"
    asked = read_task(write_scenario(path, deployment=preset(FRICTION), goal=GOAL))
    gains, budget = asked.scenario.gain_sets["scheduled"], budget_of(None, asked.scenario, asked.problem)
    found = plan(asked.problem, gains, gain_set_name="scheduled", budget=budget)
    assert isinstance(found, Found), found
    return asked, found.plan


def refusal(made, asked):
    with pytest.raises(RefusalError) as refused:
        verify_plan(made, asked.problem, asked.scenario.gain_sets)
    return refused.value.where


def test_no_friction_accelerates_anything_more_than_is_stated(rubbing):
    """In configurations drawn in every cell, each joint's friction having the worst sign."""
    asked, made = rubbing
    budget, n, tree = made.budget, len(asked.problem.tree.joints), asked.problem.tree
    chain, rates = team_chain(tree, budget.bodies, budget.rotors), np.array(made.axis_tracking.rate[1:])
    work, found, draw = team_work(chain), np.empty(3 + n), np.random.default_rng(4)
    levels, worst = budget.joint_coulomb + budget.joint_viscous * rates, np.zeros(2 + n)
    no_links, nothing = np.zeros(0, dtype=np.intp), np.zeros((0, 2))
    for cell in made.cells:
        for joints in draw.uniform(cell.lower[1:], cell.upper[1:], (20, n)):
            state, caused = np.concatenate([[0.0] * 3, joints, np.zeros(3 + n)]), np.zeros((n, 3 + n))
            for j, level in enumerate(levels):
                efforts = np.zeros(3 + n)
                efforts[3 + j] = level
                team_accelerations(
                    chain, no_links, nothing, np.zeros((0, 3)), efforts, 0.0, state, work, found
                )
                caused[j] = found
            signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * n)).reshape(n, -1)
            together = signs.T @ caused
            place = np.hypot(together[:, 0], together[:, 1]).max()
            worst = np.maximum(worst, [place, *np.abs(together[:, 2:]).max(axis=0)])
    stated = np.array(made.axis_tracking.disturbance)
    assert (worst <= stated).all()
    assert (stated <= 1.2 * worst).all()


def test_the_verifier_derives_it_and_what_follows(rubbing):
    asked, made = rubbing
    verify_plan(made, asked.problem, asked.scenario.gain_sets, budgets=scenario_budgets(*asked_of(asked)))
    tracking = made.axis_tracking
    for i, value in enumerate(tracking.disturbance):
        less = list(tracking.disturbance)
        less[i] = 0.9 * value
        smaller = replace(made, axis_tracking=replace(tracking, disturbance=tuple(less)))
        assert "disturbance" in refusal(smaller, asked) or "alarms" in refusal(smaller, asked)
    slower = replace(tracking, rate=tuple(0.5 * rate for rate in tracking.rate))
    assert "axis_tracking" in refusal(replace(made, axis_tracking=slower), asked)
    for name in ("joint_coulomb", "joint_viscous"):
        more = replace(made.budget, **{name: 2.0 * getattr(made.budget, name)})
        assert "axis_tracking.disturbance" in refusal(replace(made, budget=more), asked)
    without = replace(made.budget, joint_coulomb=0.0, joint_viscous=0.0)
    assert "axis_tracking" in refusal(replace(made, budget=without), asked)


def asked_of(asked):
    return asked.scenario, asked.problem


def test_departures_and_the_rest_count_it(rubbing):
    """What a plan without friction states is too little for the same loops with it."""
    asked, made = rubbing
    gains, own = asked.scenario.gain_sets["scheduled"], made.budget
    without = replace(own, joint_coulomb=0.0, joint_viscous=0.0)
    found = plan(asked.problem, gains, gain_set_name="scheduled", budget=without).plan
    stated = replace(found.axis_tracking, disturbance=made.axis_tracking.disturbance)
    assert refusal(replace(found, budget=own, axis_tracking=stated), asked) == "tube.radius"
    departs = [axis_loop(each, own).typical() for each in (found.axis_tracking, stated)]
    assert (np.array(departs[1]) > departs[0]).all()
    assert made.tube.rest > 0.5 * made.axis_tracking.disturbance[0] / made.tube.tracking_stiffness


def test_a_run_with_this_friction_keeps_to_the_plan_and_one_with_far_more_is_noticed(rubbing):
    asked, made = rubbing
    transport = prepare(asked.scenario, made, build_maps(made))
    for share in (0.0, 0.3, 1.0):
        sizes = {name: share * size for name, size in FRICTION.items()}
        own = replace(asked.scenario.deployment, joint_friction=JointFriction(**sizes))
        for mass_error in (-0.2, 0.2):
            outcome = run(transport, replace(own, mass_error=mass_error))
            assert outcome.arrived, outcome.reason
            assert outcome.budget_share < 1.0
            assert outcome.alarm_share < 1.0
    far = replace(asked.scenario.deployment, joint_friction=JointFriction(coulomb=20.0))
    outcome = run(transport, far)
    assert not outcome.arrived
    assert "asks for a hold" in outcome.reason
    assert outcome.budget_share > 1.0


def test_half_a_newton_metre_in_light_arms_is_more_than_their_funnels_bear():
    scenario = load_scenario(MODELS / "elbow.scenario.yaml")
    departures = convert_class(Deployment.completed(preset({"coulomb": 0.5})), Deployment)
    scenario, gains = replace(scenario, deployment=departures), scenario.gain_sets["scheduled"]
    problem = planning_problem(scenario)
    ideal = plan(problem, gains, gain_set_name="scheduled").plan
    found = fit_budget(problem, ideal, gains, replace(budget_of(None, scenario, problem), base_force=None))
    assert isinstance(found, UnprovedTransition)
    assert "its funnel" in found.reason


def test_a_budget_without_masses_or_axes_has_no_friction(tmp_path):
    for name in ("joint_coulomb", "joint_viscous"):
        with pytest.raises(DataError, match="0 without axes and bodies"):
            Budget(**{name: 0.1})
    deployment = preset(FRICTION, actuators={"base_force": None}) | {"budget": "position"}
    asked = read_task(write_scenario(tmp_path / "room.scenario.yaml", deployment=deployment))
    with pytest.raises(ScenarioError) as refused:
        budget_of(None, asked.scenario, asked.problem)
    assert refused.value.key == "deployment.joint_friction"
