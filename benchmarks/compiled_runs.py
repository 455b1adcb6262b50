"""The compiled loop beside Drake's: how many runs a second, and how far its results differ."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from hashlib import sha256
from io import BytesIO
from math import isfinite
from time import process_time
from typing import Any

import numpy as np

from benchmarks.departures import deployment_of
from benchmarks.deployed import TEAMS
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import Found, build_maps, load_scenario, plan
from coop_drake.campaign.records import RunRecord, table_of
from coop_drake.campaign.runs import record_of_log
from coop_drake.campaign.variation import Run
from coop_drake.compiled_loop import CompiledTransport, prepare, run
from coop_drake.compiling import COMPILING
from coop_drake.errors import PlanError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.simulation import simulate

DEPLOYMENTS: dict[str, dict[str, Any]] = {
    "sampled": {"control_rate": 200.0},
    "preset": {"preset": "mobile_base"},
    "budget": {"preset": "mobile_base", "budget": "all"},
}
"""Sections ``deployment`` of the pairs of runs."""

RUNS = 20
"""Compiled runs of each team and deployment of which the processor time is taken, by seeds from 0 on."""

PAIRS = 1
"""How many of them Drake's loop repeats; one takes as long as some hundred compiled ones."""

BATCH = 500
"""Runs in the file of which the size is measured, as many as in the campaigns of a million runs."""

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
    """Every shipped transport with each of the deployments, and the size of a file of runs."""
    pairs = [
        Task(f"compiled/{team}/{label}", partial(_rows, team, label), alone=True)
        for team in TEAMS
        for label in DEPLOYMENTS
    ]
    return [*pairs, Task("compiled/records", _sizes, alone=True)]


def _transport(team: str, label: str) -> tuple[CompiledTransport, Sequence[HarmonicMap]]:
    """Return a shipped transport along its plan, and its maps; what it compiles is compiled."""
    scenario = replace(load_scenario(team), deployment=deployment_of(DEPLOYMENTS[label]))
    result = plan(scenario)
    if not isinstance(result, Found):
        raise PlanError(f"{scenario.path}: no plan to measure runs of: {result.reason}")
    maps = build_maps(result.plan)
    transport = prepare(scenario, result.plan, maps)
    run(transport)
    return transport, maps


def _rows(team: str, label: str, _: Sequence[Row]) -> list[Row]:
    """Return runs a second of processor time beside Drake's loop, and the largest differences of pairs."""
    name, (transport, maps) = f"compiled/{team}/{label}", _transport(team, label)
    begun = process_time()
    outcomes = [run(transport, seed=seed) for seed in range(RUNS)]
    seconds = (process_time() - begun) / RUNS
    differences, drakes = dict.fromkeys(_COLUMNS, 0.0), 0.0
    for seed, outcome in enumerate(outcomes[:PAIRS]):
        begun, compiling = process_time(), COMPILING.cpu_seconds
        deployment = replace(transport.scenario.deployment, seed=seed)
        log = simulate(replace(transport.scenario, deployment=deployment), transport.plan, maps)
        drakes += (process_time() - begun - COMPILING.cpu_seconds + compiling) / PAIRS
        record = record_of_log(Run(0, 0, seed, {}), team, log, transport.plan, "")
        for column in _COLUMNS:
            difference = abs(getattr(outcome, column) - getattr(record, column))
            if isfinite(difference):
                differences[column] = max(differences[column], difference)
    return [
        Row(f"{name}/rate", 1.0 / seconds, "runs a second", "Drake's loop", 1.0 / drakes),
        Row(f"{name}/million", 1e6 * seconds / 3600.0, "core hours"),
        *(Row(f"{name}/{column}", differences[column], unit) for column, unit in _COLUMNS.items()),
    ]


def _sizes(_: Sequence[Row]) -> list[Row]:
    """Return the bytes of a run in the file of a batch."""
    from pyarrow import parquet

    transport, _maps = _transport("base", "budget")
    varied = np.random.default_rng(0).uniform(-0.2, 0.2, BATCH)
    records = []
    for index, error in enumerate(varied.tolist()):
        deployment = replace(transport.scenario.deployment, mass_error=error, seed=index)
        begun = RunRecord(index, "base", "compiled", index, json.dumps({"mass_error": error}), arrived=False)
        digest = sha256(str(index).encode()).hexdigest()
        outcome = vars(run(transport, deployment))
        records.append(replace(begun, digest=digest, **{n: outcome[n] for n in outcome.keys() & vars(begun)}))
    with BytesIO() as file:
        parquet.write_table(table_of(records, RunRecord), file)
        size = file.tell() / BATCH
    return [Row("compiled/records/bytes", size, "bytes a run")]
