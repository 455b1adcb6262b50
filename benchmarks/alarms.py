"""How near certified runs come to the levels of their monitors, and how often noise alone may reach these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import exp, sqrt

import numpy as np
from scipy.stats import gumbel_r

from benchmarks.departures import deployment_of
from benchmarks.deployed import TEAMS
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Found, build_maps, load_scenario, plan
from coop_drake.answers.plan import Plan
from coop_drake.compiled_loop import prepare, run
from coop_drake.errors import PlanError
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.nominal import lag_factors
from coop_drake.laws.readiness import unseen_time
from coop_drake.scenario import Scenario
from coop_drake.scenario.budget_file import DEVIATIONS, GRASP_DEVIATIONS, PLANE_DEVIATIONS

RUNS = 400
"""Runs of every shipped transport, by seeds from 0 on, with masses that are wrong within the budget."""

_HORIZON = 4.0
"""Time for which responses are added up [s]."""


def alarm_tasks() -> list[Task]:
    """Every shipped transport under the preset with ``budget: all``."""
    return [Task(f"alarms/{team}", partial(_rows, team)) for team in TEAMS]


def _rows(team: str, _: Sequence[Row]) -> list[Row]:
    """Return how many runs were held, the largest share of a level, and the chance of a false alarm."""
    scenario = replace(
        load_scenario(team), deployment=deployment_of({"preset": "mobile_base", "budget": "all"})
    )
    result = plan(scenario)
    if not isinstance(result, Found):
        raise PlanError(f"{scenario.path}: no plan to measure runs of: {result.reason}")
    transport, random = prepare(scenario, result.plan, build_maps(result.plan)), np.random.default_rng(0)
    model = scenario.deployment.mass_error
    outcomes = [
        run(transport, replace(scenario.deployment, mass_error=float(error)), seed=seed)
        for seed, error in enumerate(random.uniform(-model, model, RUNS))
    ]
    shares = np.array([outcome.alarm_share for outcome in outcomes])
    held, name = sum("asks for a hold" in outcome.reason for outcome in outcomes), f"alarms/all/{team}"
    samples, robots = max(outcome.steps for outcome in outcomes), len(transport.robot_names)
    chance = false_alarm_chance(scenario, result.plan, robots, samples)
    return [
        Row(f"{name}/arrived", sum(outcome.arrived for outcome in outcomes), "runs", "all", RUNS),
        Row(f"{name}/held", held, "runs"),
        Row(f"{name}/largest_share", float(shares.max()), "of a level"),
        Row(f"{name}/estimated_time", sum(one.estimated_time for one in result.plan.transitions), "s"),
        Row(f"{name}/chance", chance, "of a transport, by own noise"),
        Row(f"{name}/fitted_chance", float(gumbel_r.sf(1.0, *gumbel_r.fit(shares))), "of a transport"),
    ]


def false_alarm_chance(scenario: Scenario, plan: Plan, robots: int, samples: int) -> float:
    """Bound the chance that normal noise alone makes a monitor ask for a hold in a whole transport.

    It does not count the noise by which robots disagree, see "Robots that disagree" in docs/budget.md.
    All other departures are at their bounds with the worst signs at all times, so that only what noise may
    cause is left below a level: n (1 + ||h||_1), of which the noise itself takes a standard deviation of at
    most sigma (1 + ||h||_2). The chances of all samples, robots and levels are added up.

    Args:
        scenario: The scenario, with the noise.
        plan: Its plan.
        robots: Number of robots.
        samples: Number of samples of the transport.
    """
    budget, tube, tracking = plan.budget, plan.tube, plan.axis_tracking
    assert budget is not None  # as in every plan for ``budget: all``
    assert tube is not None
    assert tracking is not None
    measured = scenario.deployment.measurements
    position_std, velocity_std = measured.position_noise, budget.velocity_noise * budget.single_noise
    velocity_std /= PLANE_DEVIATIONS
    pull = tube.tracking_stiffness, tube.tracking_damping
    mean = np.array([position_std, velocity_std]) / budget.single_noise
    of_plane = _ratios(plan, pull, mean, np.array([position_std, velocity_std]), PLANE_DEVIATIONS)
    of_axis = np.array([measured.angle_noise, measured.rate_noise])
    gains = tracking.stiffness, tracking.damping
    ratios = _ratios(plan, gains, of_axis, of_axis, DEVIATIONS)
    in_plane = sum(_rayleigh(ratio) for ratio in of_plane) + _rayleigh(GRASP_DEVIATIONS)
    axes = 1 + len(plan.joint_names) / robots
    of_numbers = axes * sum(_normal(ratio) for ratio in ratios) + _normal(GRASP_DEVIATIONS)
    return min(1.0, samples * robots * (in_plane + of_numbers))


def _ratios(
    plan: Plan, gains: tuple[float, float], caused: np.ndarray, own: np.ndarray, deviations: float
) -> list[float]:
    """Return how many standard deviations a level leaves to noise, of measured x, x' and x + t x'.

    Args:
        plan: The plan.
        gains: Stiffness and damping of the pull.
        caused: Standard deviations of the errors of x and x' that act on the loop.
        own: Those of one robot's measurements.
        deviations: Standard deviations that count as a bound.
    """
    budget = plan.budget
    assert budget is not None
    ahead, ratios = (
        unseen_time(budget.delay, budget.report_age, budget.period, budget.age_error),
        [np.inf] * 3,
    )
    for error in (-budget.model_error, 0.0, budget.model_error):
        x, v = _responses(gains, 1.0 + error, budget.period, budget.lag, budget.delay)
        for i, (h, errors) in enumerate(((x, own[:1]), (v, own[1:]), (x + ahead * v, own * [1.0, ahead]))):
            bound = deviations * (np.dot(gains, caused) * np.abs(h).sum() + errors.sum())
            pulled = sqrt((gains[0] * caused[0]) ** 2 + (gains[1] * caused[1]) ** 2) * sqrt(float(h @ h))
            ratios[i] = min(ratios[i], bound / (pulled + np.hypot.reduce(errors)))
    return ratios


def _responses(
    gains: tuple[float, float], factor: float, period: float, lag: float, delay: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return x and x' at all samples after a unit of command in the first period."""
    samples, age = whole_periods(_HORIZON, period), whole_periods(delay, period)
    left, in_v, in_x = lag_factors(period, lag)
    x, v, q = np.zeros(samples + 1), np.zeros(samples + 1), 0.0
    for k in range(samples):
        pull = -gains[0] * x[k - age] - gains[1] * v[k - age] if k >= age else 0.0
        u = pull + (1.0 if k == 0 else 0.0)
        x[k + 1] = x[k] + period * v[k] + factor * (0.5 * period * period * u + in_x * (q - u))
        v[k + 1] = v[k] + factor * (period * u + in_v * (q - u))
        q = u + left * (q - u)
    return x, v


def _rayleigh(ratio: float) -> float:
    """Return the chance that a normal vector in the plane is longer than so many standard deviations."""
    return exp(-0.5 * ratio * ratio)


def _normal(ratio: float) -> float:
    """Bound the chance that a normal number is farther from zero than so many standard deviations."""
    return exp(-0.5 * ratio * ratio) * sqrt(2.0 / np.pi) / ratio
