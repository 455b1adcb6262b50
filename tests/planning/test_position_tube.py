"""The position's tube: bounds, plans that keep it, runs that stay in it."""

import re
from dataclasses import replace
from functools import cache
from math import ceil, sqrt

import numpy as np
import pytest
from shapely import box

from benchmarks.sampled_position import run_position, worst_departures
from coop_drake.answers import Plan
from coop_drake.answers.budget import Budget
from coop_drake.compiled_loop import prepare
from coop_drake.errors import RefusalError, ScenarioError
from coop_drake.laws import ScheduledGains
from coop_drake.laws.nominal import nominal_flow
from coop_drake.planning.budget.position_fit import UnprovedPosition, commanded_accelerations, fit_position
from coop_drake.planning.transitions import with_gains
from coop_drake.plant import planning_problem
from coop_drake.robustness.alarms import alarms_of, position_room, unseen_of
from coop_drake.robustness.position import PositionGains, position_tubes
from coop_drake.scenario import ActuatorLimits, Deployment, Hold, Measurements, Messages
from coop_drake.scenario.model import Control
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification.runs.budget import check_budget_used
from coop_drake.verification.runs.rows import Rows
from tests.support.run_checks import verified_run
from tests.support.sampled_block import simulate_sampled
from tests.support.small_loop import small_problem
from tests.support.tubes import BUDGET, tubed_problem

GAINS = PositionGains(100.0, 14.0, 250.0, 1.4 * sqrt(250.0), 0.8)
BUDGETS = {
    "sampled": Budget(acceleration_error=0.5),
    "old": Budget(delay=0.01, acceleration_error=0.3),
    "lagging": Budget(delay=0.005, lag=0.005, position_noise=1e-3),
    "noisy": Budget(position_noise=2e-3, velocity_noise=0.04),
    "wrong": Budget(delay=0.005, model_error=0.3),
    "all": BUDGET,
}


def sizes_of(budget):
    speed = GAINS.speed * budget.period
    return np.array([speed, budget.position_noise, budget.velocity_noise, budget.acceleration_error])


@pytest.mark.parametrize("name", BUDGETS)
def test_the_worst_disturbances_stay_in_the_tube_and_almost_reach_it(name):
    budget = BUDGETS[name]
    (tube,) = position_tubes([GAINS], budget)
    delay, reached = ceil(budget.delay / budget.period - 1e-6), 0.0
    for factor in 1.0 + budget.model_error * np.linspace(-1.0, 1.0, 5):
        departures = worst_departures(GAINS, budget.period, delay, budget.lag, factor, sizes_of(budget))
        assert np.abs(departures).max() <= tube.radius
        reached = max(reached, np.abs(departures[-1]))
    assert reached >= (0.9 if budget.model_error == 0.0 else 0.7) * tube.radius


@pytest.mark.parametrize("name", BUDGETS)
def test_random_disturbances_stay_in_the_tube_and_rest_nearer(name):
    budget, generator = BUDGETS[name], np.random.default_rng(7)
    (tube,) = position_tubes([GAINS], budget)
    row = GAINS.stiffness, GAINS.damping, GAINS.tracking_stiffness, GAINS.tracking_damping
    flow, motion = nominal_flow(GAINS.stiffness, GAINS.damping, budget.period), np.zeros((1200, 4))
    for _ in range(30):
        lengths = generator.integers(1, 80, 1200)
        signs = np.repeat(generator.choice([-1.0, 1.0], (1200, 4)), lengths, axis=0)[:1200]
        disturbances = sizes_of(budget) * signs * generator.choice([1.0, generator.random()])
        disturbances[600:, 0] = 0.0
        factor = 1.0 + budget.model_error * generator.uniform(-1.0, 1.0)
        delay = ceil(budget.delay / budget.period - 1e-6)
        run_position(flow, row, budget.period, delay, budget.lag, factor, disturbances, motion)
        assert np.abs(motion[:, 0] - motion[:, 2]).max() <= tube.radius
        assert np.abs(motion[:, 1] - motion[:, 3]).max() <= tube.rate
        assert np.abs(motion @ [1.0, unseen_of(budget), -1.0, -unseen_of(budget)]).max() <= tube.ahead
        assert np.abs(motion[-200:, 0] - motion[-200:, 2]).max() <= tube.rest + 1e-4


def run_with_clocks(budget, generator, speed):
    """e, e' at all samples of a team whose clocks jump about within their error: twenty steps a period."""
    n, T, delay = 20, budget.period, ceil(budget.delay / budget.period - 1e-6)
    h, factor, signs = T / n, 1.0 + budget.model_error * generator.uniform(-1.0, 1.0), np.ones(4)
    flow, jumps = nominal_flow(GAINS.stiffness, GAINS.damping, T), generator.integers(1, 40)
    p, v = np.zeros((2, 600 * n + 1))
    nominal, led, s, goal = np.zeros((601, 2)), np.zeros(2), 0.0, 0.0
    most = round(budget.age_error / h)
    found = np.empty((600, 2))
    for k in range(600):
        nominal[k], now = led, k * n
        found[k] = p[now] - led[0], v[now] - led[1]
        signs = generator.choice([-1, 1], 4) if k % jumps == 0 else signs
        then = max(k - delay, 0)
        seen = np.clip(then * n - signs[0] * most, 0, now)
        noise = signs[1] * budget.position_noise, signs[2] * budget.velocity_noise
        u = -GAINS.stiffness * (led[0] - goal) - GAINS.damping * led[1]
        u -= GAINS.tracking_stiffness * (p[seen] + noise[0] - nominal[then, 0])
        u -= GAINS.tracking_damping * (v[seen] + noise[1] - nominal[then, 1])
        for i in range(now, now + n):
            s = u + (s - u) * np.exp(-h / budget.lag) if budget.lag else u
            a = factor * s + signs[3] * budget.acceleration_error
            p[i + 1], v[i + 1] = p[i] + h * v[i] + 0.5 * h * h * a, v[i] + h * a
        led = np.array([goal, 0.0]) + flow[:, :2] @ (led - [goal, 0.0])
        goal += speed * T
    return found


@pytest.mark.parametrize("clock_error", [5e-4, 2e-3])
def test_clocks_that_jump_within_their_error_keep_the_object_in_the_tube(clock_error):
    budget, generator = replace(BUDGET, clock_error=clock_error), np.random.default_rng(3)
    (tube,) = position_tubes([GAINS], budget)
    (right,) = position_tubes([GAINS], replace(budget, clock_error=0.0))
    for _ in range(6):
        away = np.abs(run_with_clocks(budget, generator, GAINS.speed))
        assert (away.max(axis=0) <= [tube.radius, tube.rate]).all()
    silent = replace(budget, position_noise=0.0, velocity_noise=0.0, acceleration_error=0.0, model_error=0.0)
    (alone,) = position_tubes([GAINS], silent)
    moved = np.abs(run_with_clocks(silent, generator, GAINS.speed))[300:, 0].max()
    assert moved > 0.2 * alone.radius  # clocks alone take it there: what is counted is not beside the point
    assert tube.radius > right.radius
    assert tube.rest > right.rest


def test_clocks_that_are_wrong_by_several_periods_leave_no_tube():
    assert position_tubes([GAINS], replace(BUDGET, clock_error=0.05)) == [None]


@pytest.mark.parametrize("clock_error", [0.0, 5e-4])
def test_whatever_departs_below_all_levels_stays_in_its_room_until_a_report_tells_of_it(clock_error):
    """It may be as far and as fast as measurements with the worst noise just do not show."""
    budget, generator = replace(BUDGET, clock_error=clock_error), np.random.default_rng(4)
    (tube,) = position_tubes([GAINS], budget)
    alarms, room, t = alarms_of(budget, tube), position_room(budget, tube), unseen_of(budget)
    assert (
        alarms.velocity * t > room - alarms.position > 0.0
    )  # by its velocity alone it would be seen too late
    farthest = 0.0
    for _ in range(2000):
        e, v, noise, rate_noise = (generator.uniform(-1.0, 1.0, 4) ** 3) * [0.05, 1.5, 0.0, 0.0] + [
            0.0, 0.0, *generator.choice([-1.0, 1.0], 2) * [budget.position_noise, budget.velocity_noise]
        ]  # fmt: skip
        x, rate = e + noise, v + rate_noise
        if abs(x) > alarms.position or abs(x + t * rate) > alarms.ahead or abs(rate) > alarms.velocity:
            continue
        s = np.linspace(0.0, t, 9)
        away = np.abs(e + s * v + 0.5 * budget.acceleration_error * s**2 * np.sign(e + t * v)).max()
        assert away <= room
        farthest = max(farthest, away)
    assert farthest > (0.9 if clock_error == 0.0 else 0.8) * room


def test_without_departures_the_tube_is_what_sampling_leaves():
    (tube,) = position_tubes([GAINS], Budget())
    assert tube.radius < 0.005
    assert tube.rest < 2e-4


def test_a_loop_that_is_not_stable_has_no_tube():
    assert position_tubes([GAINS], Budget(delay=0.2)) == [None]


def test_the_plan_keeps_its_nominal_motion_as_far_from_the_walls_as_the_tube_is_wide():
    _, plan = tubed_problem()
    for cell, transition in zip(plan.cells, plan.transitions, strict=True):
        assert cell.tidied.contains(transition.governed)
        assert transition.governed.boundary.distance(cell.tidied.boundary) >= plan.tube.radius
    assert len({transition.gains.stiffness for transition in plan.transitions}) == 1


def test_a_plan_with_other_gains_has_no_tube():
    _, plan = tubed_problem()
    other = with_gains(plan, ScheduledGains(), "other")
    assert (other.budget, other.tube) == (None, None)
    assert other.governed(0).equals(plan.cells[0].tidied)


LIMITS = {
    "rest": (replace(BUDGET, position_noise=0.02), r"may rest .* mm from the goal"),
    "delay": (replace(BUDGET, delay=0.08), "is not stable"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", LIMITS)
def test_what_does_not_hold_is_said(name):
    scenario, plan = small_problem()
    budget, said = LIMITS[name]
    found = fit_position(planning_problem(scenario), plan, ScheduledGains(), budget)
    assert isinstance(found, UnprovedPosition)
    assert re.search(said, found.reason)


def test_slower_motion_is_chosen_where_accelerations_are_limited():
    scenario, plan = small_problem()
    problem, gains = planning_problem(scenario), ScheduledGains()
    accelerations = commanded_accelerations(problem, plan, gains, BUDGET)
    assert accelerations == sorted(set(accelerations), reverse=True)
    speeds = []
    for most in (accelerations[0], 15.0, accelerations[-1]):
        found = fit_position(problem, plan, gains, BUDGET, most)
        assert isinstance(found, Plan)
        assert found.tube.acceleration <= most
        speeds.append(found.tube.speed)
    assert speeds[0] > speeds[1] > speeds[2]


def test_a_cell_that_is_too_narrow_is_named():
    scenario, plan = small_problem()
    x, y = plan.transitions[0].target
    cell = replace(plan.cells[1], tidied=box(x - 0.005, y - 0.005, x + 3.0, y + 0.005))
    narrow = replace(plan, cells=(plan.cells[0], cell, *plan.cells[2:]))
    found = fit_position(planning_problem(scenario), narrow, ScheduledGains(), BUDGET)
    assert isinstance(found, UnprovedPosition)
    assert "in transition 0 the object may depart" in found.reason


# A team within its budget stays in the position's tube, in Drake's loop and in the compiled one.


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
