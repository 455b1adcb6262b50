"""A plan under a budget keeps the limits of its actuators, or it is refused."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from coop_drake.answers import Found
from coop_drake.answers.budget import LIMITS
from coop_drake.cli.task import read_task
from coop_drake.compiled_loop import prepare, run
from coop_drake.errors import RefusalError, ScenarioError
from coop_drake.planning.planner import plan
from coop_drake.plant.facts import budget_of
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification.budget import check_budget, check_efforts
from tests.support.scenarios import write_scenario

QUIET = {"position_noise": 0.0003, "angle_noise": 0.0002, "rate_noise": 0.003}


@cache
def task(folder, **limits):
    actuators = {"lag": 0.005, **limits}
    deployment = {"preset": "mobile_base", "budget": "all", "actuators": actuators, "measurements": QUIET}
    return read_task(write_scenario(folder / "room.scenario.yaml", deployment=deployment))


def answer(asked):
    gains = asked.scenario.gain_sets["scheduled"]
    budget = budget_of(None, asked.scenario, asked.problem)
    return plan(asked.problem, gains, gain_set_name="scheduled", budget=budget)


@pytest.fixture(scope="module")
def limited(tmp_path_factory):
    """A scenario whose limits leave room for a slow motion, and its plan."""
    asked = task(tmp_path_factory.mktemp("room"), base_force=200.0, base_torque=150.0, joint_effort=150.0)
    found = answer(asked)
    assert isinstance(found, Found), found
    return asked, found.plan


@pytest.mark.slow
def test_a_force_that_cannot_be_kept_is_refused_by_its_reason(tmp_path):
    """The position's part of it alone would be 49 N."""
    found = answer(task(tmp_path, base_force=50.0))
    assert not isinstance(found, Found)
    assert "the base of robot" in found.reason
    assert "may be told to give" in found.reason


def test_a_run_asks_for_no_more_than_its_plan_states(limited):
    asked, made = limited
    log = simulate(asked.scenario, made, build_maps(made))
    assert (log.reached, log.violation) == (True, "")
    stated = np.array([one.tolerance.effort for one in made.transitions])[log.cell_index]
    forces = np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1])
    assert (forces <= stated[:, :2]).all()
    assert (np.abs(log.base_wrenches[..., 2]) <= stated[:, 2:4]).all()
    assert (np.abs(log.joint_torques) <= stated[:, 4:]).all()
    assert forces.max() > 0.1 * stated[:, :2].max()


@pytest.mark.slow
def test_whatever_departs_within_the_budget_no_robot_asks_for_more_than_is_stated(limited):
    """Limits just as large as what is stated change nothing of any run, not even its last bit."""
    asked, made = limited
    transport = prepare(asked.scenario, made, build_maps(made))
    stated = np.array([one.tolerance.effort for one in made.transitions]).max(axis=0)
    parts = stated[:2].max(), stated[2:4].max(), stated[4:].max()
    own = asked.scenario.deployment

    def outcome(seed, limits):
        random = np.random.default_rng(seed)
        error = float(random.uniform(-own.mass_error, own.mass_error))
        actuators = replace(own.actuators, **dict(zip(LIMITS, limits, strict=True)))
        return run(transport, replace(own, seed=seed, mass_error=error, actuators=actuators))

    most = 0.0
    for seed in range(40):
        free = outcome(seed, (None,) * 3)
        assert free.arrived, free.reason
        assert outcome(seed, parts) == free
        most = max(most, free.peak_force)
    assert outcome(0, (0.3 * most, None, None)) != outcome(0, (None,) * 3)


@pytest.mark.slow
def test_the_verifier_accepts_what_is_stated_and_refuses_less_and_smaller_limits(limited):
    asked, made = limited
    tree = asked.problem.tree
    check_budget(made, tree)
    assert [check.tightest > 0.0 for check in check_efforts(made)] == [True, True, True]

    def refusal(changed):
        with pytest.raises(RefusalError) as refused:
            check_budget(changed, tree)
        return refused.value.where

    for entry in range(6):
        first = made.transitions[0]
        efforts = first.tolerance.effort.copy()
        efforts[entry] *= 0.7
        own = replace(first, tolerance=replace(first.tolerance, effort=efforts))
        transitions = (own, *made.transitions[1:])
        assert refusal(replace(made, transitions=transitions)) == f"transitions[0].tolerance.effort[{entry}]"
    for name, entry in (("base_force", 0), ("base_torque", 2), ("joint_effort", 4)):
        weaker = replace(made.budget, **{name: 0.99 * made.transitions[0].tolerance.effort[entry]})
        assert "tolerance.effort" in refusal(replace(made, budget=weaker))


@pytest.mark.parametrize("key", ["predictor", "observer", "hold"])
def test_what_changes_the_loop_or_the_clock_is_refused(limited, key):
    asked, _ = limited
    control = replace(asked.scenario.control, **{key: {} if key == "hold" else True})
    with pytest.raises(ScenarioError) as refused:
        budget_of(None, replace(asked.scenario, control=control), asked.problem)
    assert refused.value.key == f"control.{key}"
