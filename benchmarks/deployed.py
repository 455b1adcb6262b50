"""Shipped transports under the preset of a usual team, beside those of the ideal team."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from benchmarks.departures import departing, deployment_of, peak_force
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake import SimulationLog
from coop_drake.scenario import Control

TEAMS = ("base", "tight", "three", "elbow", "warehouse")
MASS_ERRORS = (-0.2, 0.0, 0.2)
SEEDS = range(5)

_PRESET = {"preset": "mobile_base"}
DEPLOYMENTS: dict[str, list[dict[str, Any]]] = {
    "ideal": [{"control_rate": None}],
    **{
        label: [
            {**_PRESET, **delay, "mass_error": error, "seed": seed} for error in MASS_ERRORS for seed in SEEDS
        ]
        for label, delay in (("preset", {}), ("preset_20_ms", {"measurements": {"delay": 0.02}}))
    },
}
"""Sections ``deployment`` of the runs of each row."""


def deployed_tasks() -> list[Task]:
    """Every shipped transport, ideal and under the preset; each run is one of many seeds and mass errors."""
    return [
        Task(f"deployed/{team}/{label}", partial(_rows, team, label), alone=True)
        for team in TEAMS
        for label in DEPLOYMENTS
    ]


def _rows(team: str, label: str, rows: Sequence[Row]) -> list[Row]:
    """Return the worst figures of all runs: times beside the ideal team's, forces, and margins."""
    logs = [departing(team, deployment_of(data), Control()) for data in DEPLOYMENTS[label]]
    name, peer = f"deployed/{team}/{label}", f"deployed/{team}/ideal/slowest"
    arrived = [log for log in logs if log.reached]
    ideal = next((row.value for row in rows if row.name == peer), None)
    found = [Row(f"{name}/arrived", len(arrived), "runs", "all", len(logs))]
    if arrived:
        slowest = float(max(log.times[-1] for log in arrived))
        found.append(Row(f"{name}/slowest", slowest, "s", "ideal", slowest if label == "ideal" else ideal))
        found += [Row(f"{name}/{key}", value, unit) for key, value, unit in worst(arrived)]
    return found


def worst(logs: Sequence[SimulationLog]) -> list[tuple[str, float, str]]:
    """Return the largest base force and the smallest margins of some runs, each with its unit."""
    force = max(peak_force(log) for log in logs)
    margins = [
        (name, 1e3 * min(float(getattr(log, name).min()) for log in logs))
        for name in ("funnel_margin", "cell_clearance", "workspace_clearance", "body_clearance")
    ]
    return [("base_force", force, "N"), *((name, value, "mrad or mm") for name, value in margins)]
