"""Budgets on whole scenarios: limits of actuators, departures of a usual team, limits of rates."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from benchmarks.sampled_plan import random_departures, run_axes, worst_departures
from coop_drake.answers import Found
from coop_drake.answers.budget import LIMITS, Budget
from coop_drake.cli import app
from coop_drake.cli.task import read_task
from coop_drake.compiled_loop import prepare, run
from coop_drake.diagram.robot_controller import axis_levels
from coop_drake.errors import RefusalError, ScenarioError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.budget.fitting import fit_budget
from coop_drake.planning.planner import plan
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import budget_of, scenario_budgets
from coop_drake.robustness.alarms import unseen_of
from coop_drake.shipped import scenario_file
from coop_drake.simulation import build_maps, simulate
from coop_drake.verification import verify_plan
from coop_drake.verification.budget import check_budget, check_efforts
from coop_drake.verification.gains import check_ages
from tests.support.scenarios import write_scenario
from tests.support.small_loop import small_problem
from tests.support.tubes import WITH_AXES

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


# Base carries the budget of a usual team, three standard deviations of its noise being bounds.


MOBILE_BASE = Budget(
    control_rate=200.0, delay=0.01, lag=0.005, angle_noise=0.0015, rate_noise=0.03, model_error=0.2,
    acceleration_error=0.2, report_age=0.025,
)  # fmt: skip
"""The numbers of the preset, with three standard deviations of its noise."""


@pytest.fixture(scope="module")
def base():
    task = read_task(scenario_file(Path("base")))
    gain_set = task.scenario.gain_sets["scheduled"]
    answer = plan(task.problem, gain_set, gain_set_name="scheduled", budget=MOBILE_BASE)
    assert isinstance(answer, Found)
    return answer.plan


def stated(plan, name):
    return np.array([getattr(transition.tolerance, name) for transition in plan.transitions])


@pytest.mark.slow
@pytest.mark.parametrize(("departures", "count"), [(random_departures, 60), (worst_departures, 12)])
def test_departures_within_the_budget_never_take_an_axis_farther_than_stated(base, departures, count):
    runs = [run_axes(base, MOBILE_BASE, departures(base, MOBILE_BASE, seed)) for seed in range(count)]
    assert min(run.nearest for run in runs) >= stated(base, "distance").min() > 0.0
    away, ahead = np.max([run.farthest for run in runs], axis=0)
    assert (away <= stated(base, "departure")).all()
    assert (ahead <= [np.max(one, axis=0) for one in stated_rows(base, "ahead_alarm")]).all()


def test_the_worst_departures_use_more_than_half_of_what_is_stated(base):
    runs = [run_axes(base, MOBILE_BASE, worst_departures(base, MOBILE_BASE, seed)) for seed in range(4)]
    shares = np.max([run.farthest[0] for run in runs], axis=0) / stated(base, "departure")
    assert shares.max(axis=0).min() > 0.5


def least_room_after(base, factor, side):
    """Return the least distance to a bound of a funnel for the time t after something took all axes away.

    It takes them as far and as fast as measurements with the worst noise just do not show, or ``factor``
    times as far, again and again, at instants in all cells, at hand-overs, too. From then on the errors of
    the model and of accelerations and the noise that robots pull with drive them on, within the budget.
    """
    budget, t = MOBILE_BASE, unseen_of(MOBILE_BASE)
    (times, levels), unseen = axis_levels(base), round(t / budget.period)
    none, hidden = random_departures(base, budget.scaled(0.0), 0), (budget.angle_noise, budget.rate_noise)
    places = run_axes(base, replace(budget.scaled(0.0), report_age=budget.report_age), none).places
    assert places[-1, 0] == len(base.cells) - 1
    generator, least = np.random.default_rng(3), np.inf
    for attempt in range(20):
        errors = np.full((*none.disturbances.shape[:2], 5), np.nan)
        errors[..., :3] = np.multiply([-side, -side, side], [*hidden, budget.acceleration_error])
        entries = np.flatnonzero(places[:, 1] == 0) + generator.integers(-unseen, 3, len(base.cells))
        kicked = np.arange(7 * attempt % 60, len(places) - unseen, 60) if attempt % 2 else entries
        kicked = np.maximum(kicked, 0)
        for k in kicked:
            heard = max(k - generator.integers(2), 0)  # robots hear of a switch one period late
            cell, since = int(places[heard, 0]), places[heard, 1] * budget.period
            stage = max(np.searchsorted(times[cell], since, side="right") - 1, 0)
            a, b, c = factor * levels[cell, stage]
            x = generator.choice([-1.0, 0.0, 1.0, generator.uniform(-1.0, 1.0)]) * a
            rate = np.clip((side * c - x) / t, -b, b)
            errors[k, :, 3] = np.clip(x, -c - t * rate, c - t * rate) + side * hidden[0]
            errors[k, :, 4] = rate + side * hidden[1]
        for sign in (side, -side):
            factors = np.full(len(base.start) - 2, 1.0 + sign * budget.model_error)
            run = run_axes(base, budget, none._replace(disturbances=errors, factors=factors))
            assert len(run.rooms) == len(places) or factor > 1.0
            seen = kicked[kicked < len(run.rooms)]
            least = min(least, *(run.rooms[k : k + unseen + 1].min() for k in seen))
    return least


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_whatever_departs_below_all_levels_stays_in_its_funnel_until_a_report_tells_of_it(base, side):
    assert least_room_after(base, 1.0, side) > 0.0
    assert least_room_after(base, 2.0, side) < 0.0


def stated_rows(plan, name):
    return [getattr(transition.tolerance, name) for transition in plan.transitions]


def test_departures_two_and_a_half_times_as_large_lose_an_axis(base):
    larger = MOBILE_BASE.scaled(2.5)
    larger = replace(larger, delay=MOBILE_BASE.delay, lag=MOBILE_BASE.lag, report_age=MOBILE_BASE.report_age)
    runs = [run_axes(base, larger, worst_departures(base, larger, seed)) for seed in range(2)]
    assert min(run.nearest for run in runs) < 0.0


def test_gains_for_a_share_of_the_limits_of_rates_state_none_where_no_rate_is_limited(monkeypatch):
    """The only limit is the speed of a base at the object's origin, to which no axis adds."""
    monkeypatch.setattr(
        "coop_drake.planning.budget.fitting.CHOICES", (tuple((older, 0.5) for older in (1.0, 2.0, 3.0)),)
    )
    gains = ScheduledGains(command_age=0.0175)
    scenario, made = small_problem("base", gains)
    problem, none = planning_problem(scenario), np.array([np.inf])
    limits = replace(
        problem.limits,
        base_components=(0,),
        base_points=((0.0, 0.0),),
        base_speeds=np.array([0.3]),
        turn_rates=none,
        joint_rates=np.repeat(none, len(made.joint_names)),
    )
    fitted = fit_budget(replace(problem, limits=limits), made, gains, WITH_AXES)
    assert not np.isfinite([one.gains.rate_limit for one in fitted.transitions]).any()
    assert max(one.gains.speed_limit for one in fitted.transitions) < 0.3
    check_ages(fitted, gains)


@pytest.mark.slow
@pytest.mark.parametrize("flags", [["--robots", "3", "--door", "1.3"], ["--robots", "4"]])
def test_narrow_limits_of_rates_are_kept_by_gains_for_a_share_of_them(tmp_path, flags):
    """One metre per second and two radians, as a new scenario has them, under the preset."""
    path = tmp_path / "hall" / "hall.scenario.yaml"
    assert CliRunner().invoke(app, ["new", "hall", *flags, "--out", str(path.parent)]).exit_code == 0
    path.write_text(path.read_text() + "\ndeployment: {preset: mobile_base, budget: all}\n")
    task = read_task(path)
    gain_sets = task.scenario.gain_sets
    budget = budget_of(None, task.scenario, task.problem)
    answer = plan(task.problem, gain_sets["scheduled"], gain_set_name="scheduled", budget=budget)
    assert isinstance(answer, Found)
    assert min(one.tolerance.rate_share for one in answer.plan.transitions) < 1.0
    budgets = scenario_budgets(task.scenario, task.problem)
    verify_plan(answer.plan, task.problem, gain_sets, budgets=budgets)
