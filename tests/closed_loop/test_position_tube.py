"""A team within its budget stays in the position's tube, in Drake's loop and in the compiled one."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from coop_drake.compiled_loop import prepare
from coop_drake.errors import RefusalError, ScenarioError
from coop_drake.scenario import ActuatorLimits, Deployment, Hold, Measurements, Messages
from coop_drake.scenario.model import Control
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification.runs.budget import check_budget_used
from coop_drake.verification.runs.rows import Rows
from tests.support.run_checks import verified_run
from tests.support.sampled_block import simulate_sampled
from tests.support.tubes import BUDGET, tubed_problem

COMPARED = replace(BUDGET, delay=0.0, lag=0.0, position_noise=0.0, velocity_noise=0.0)


@cache
def problem(budget):
    scenario, plan = tubed_problem(budget)
    return scenario, plan, build_maps(plan)


@cache
def noisy_run():
    scenario, plan, maps = problem(BUDGET)
    deployment = Deployment(
        control_rate=200.0,
        mass_error=-0.15,
        measurements=Measurements(delay=0.01, position_noise=0.0008, angle_noise=0.0003, rate_noise=0.008),
        actuators=ActuatorLimits(base_force=300.0, lag=0.005),
        messages=Messages(loss=0.2),
    )
    scenario = replace(scenario, deployment=deployment)
    return scenario, plan, simulate(scenario, plan, maps)


@pytest.mark.slow
def test_a_noisy_late_and_wrong_team_stays_in_the_tube():
    scenario, plan, log = noisy_run()
    assert (log.reached, log.violation) == (True, "")
    used, fast = check_budget_used(Rows(log, plan))
    assert 0.01 < used.tightest < 0.6
    assert 0.01 < fast.tightest < 0.6
    assert log.governor_spread.max() == 0.0
    assert verified_run(scenario, plan, log).answer == "arrived"
    rest = np.linalg.norm(log.object_pose[-1, :2] - plan.goal_pose[:2])
    assert rest < scenario.goal.tolerances.position


@pytest.mark.slow
@pytest.mark.parametrize("mass_error", [-0.2, 0.2])
def test_the_compiled_loop_leads_as_blocks_do(mass_error):
    scenario, plan, maps = problem(COMPARED)
    scenario = replace(scenario, deployment=Deployment(control_rate=200.0, mass_error=mass_error))
    found = simulate_sampled(prepare(scenario, plan, maps))
    used, fast = check_budget_used(Rows(found, plan))
    assert found.reached
    assert max(used.tightest, fast.tightest) < 0.8
    if mass_error > 0.0:
        named = simulate(scenario, plan, maps)
        assert len(named.times) == len(found.times)
        for name in ("object_pose", "governor_position", "energy_margin", "ready_margins"):
            np.testing.assert_allclose(getattr(named, name), getattr(found, name), atol=1e-9)


def test_a_held_team_keeps_its_tube():
    scenario, plan, maps = problem(COMPARED)
    scenario = replace(scenario, control=Control(hold=Hold(at=(0.4,), duration=1.0)))
    log = simulate(scenario, plan, maps)
    used, fast = check_budget_used(Rows(log, plan))
    assert log.reached
    assert max(used.tightest, fast.tightest) < 0.8
    still = (log.times > 1.3) & (log.held > 0.0)
    assert np.ptp(log.governor_position[still], axis=0).max() < 1e-3


def test_a_log_that_departs_from_the_tube_is_refused():
    _, plan, log = noisy_run()
    row = len(log.times) // 2
    moved = log.object_pose.copy()
    moved[row, 0] += 2.0 * plan.tube.radius
    with pytest.raises(RefusalError, match="from its nominal motion"):
        check_budget_used(Rows(replace(log, object_pose=moved), plan))
    led = log.governor_position.copy()
    led[row:] += 0.01
    with pytest.raises(RefusalError, match="in a period"):
        check_budget_used(Rows(replace(log, governor_position=led), plan))


def test_a_plan_with_a_tube_needs_a_control_rate():
    scenario, plan, maps = problem(COMPARED)
    with pytest.raises(ScenarioError, match="control_rate"):
        simulate(replace(scenario, deployment=Deployment()), plan, maps)
