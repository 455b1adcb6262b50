"""The compiled loop beside Drake's: how many runs a second, and how far its results differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import isfinite
from time import process_time
from typing import Any

from benchmarks.departures import deployment_of
from benchmarks.deployed import TEAMS
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Found, build_maps, load_scenario, plan, simulate
from coop_drake.campaign.measuring import record_of_log
from coop_drake.campaign.variation import Run
from coop_drake.compiled_loop import prepare, run
from coop_drake.errors import PlanError

DEPLOYMENTS: dict[str, dict[str, Any]] = {
    "sampled": {"control_rate": 200.0},
    "preset": {"preset": "mobile_base"},
    "budget": {"preset": "mobile_base", "budget": "all"},
}
"""Sections ``deployment`` of the pairs of runs."""

SEEDS = (0,)
"""Seeds of the pairs of runs."""

_COLUMNS = {
    "time": "s",
    "funnel_margin": "rad or m",
    "cell_margin": "m",
    "wall_clearance": "m",
    "body_clearance": "m",
    "budget_share": "of the budget",
    "peak_force": "N",
}
"""Columns of the records that are compared, with their units."""


def compiled_tasks() -> list[Task]:
    """Every shipped transport with each of the deployments."""
    return [
        Task(f"compiled/{team}/{label}", partial(_rows, team, label), alone=True)
        for team in TEAMS
        for label in DEPLOYMENTS
    ]


def _rows(team: str, label: str, _: Sequence[Row]) -> list[Row]:
    """Return runs a second of processor time beside Drake's loop, and the largest differences of pairs."""
    name, deployment = f"compiled/{team}/{label}", deployment_of(DEPLOYMENTS[label])
    scenario = replace(load_scenario(team), deployment=deployment)
    result = plan(scenario)
    if not isinstance(result, Found):
        raise PlanError(f"{scenario.path}: no plan to measure runs of: {result.reason}")
    maps = build_maps(result.plan)
    transport = prepare(scenario, result.plan, maps)
    run(transport)  # compiles
    differences, seconds, drakes = dict.fromkeys(_COLUMNS, 0.0), 0.0, 0.0
    for seed in SEEDS:
        begun = process_time()
        outcome = run(transport, seed=seed)
        ended = process_time()
        log = simulate(replace(scenario, deployment=replace(deployment, seed=seed)), result.plan, maps)
        seconds, drakes = seconds + ended - begun, drakes + process_time() - ended
        record = record_of_log(Run(0, 0, seed, {}), team, log, result.plan, "", "named")
        for column in _COLUMNS:
            difference = abs(getattr(outcome, column) - getattr(record, column))
            if isfinite(difference):
                differences[column] = max(differences[column], difference)
    return [
        Row(f"{name}/rate", len(SEEDS) / seconds, "runs a second", "Drake's loop", len(SEEDS) / drakes),
        *(Row(f"{name}/{column}", differences[column], unit) for column, unit in _COLUMNS.items()),
    ]
