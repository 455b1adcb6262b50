"""How near certified runs come to the levels of their monitors, and how often noise alone may reach these."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.stats import gumbel_r

from benchmarks.departures import deployment_of
from benchmarks.deployed import TEAMS
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Found, build_maps, load_scenario, plan
from coop_drake.compiled_loop import prepare, run
from coop_drake.errors import PlanError

RUNS = 400
"""Runs of every shipped transport, by seeds from 0 on, with masses that are wrong within the budget."""


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
    held, name = sum(outcome.held > 0 for outcome in outcomes), f"alarms/all/{team}"
    return [
        Row(f"{name}/arrived", sum(outcome.arrived for outcome in outcomes), "runs", "all", RUNS),
        Row(f"{name}/held", held, "runs"),
        Row(f"{name}/largest_share", float(shares.max()), "of a level"),
        Row(f"{name}/estimated_time", sum(one.estimated_time for one in result.plan.transitions), "s"),
        Row(f"{name}/fitted_chance", float(gumbel_r.sf(1.0, *gumbel_r.fit(shares))), "of a transport"),
    ]
