"""How far the tiers of a campaign agree on the same runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.campaign.report.columns import MEASURES, Runs


@dataclass(frozen=True)
class Agreement:
    """Differences between the two tiers' results of the same runs, in units of the columns.

    Attributes:
        scenario: Name of the scenario.
        pairs: Runs that both tiers simulated.
        verdicts: Pairs of which one arrived and the other did not.
        largest: Largest difference by the name of the column; over pairs that both arrived.
    """

    scenario: str
    pairs: int
    verdicts: int
    largest: dict[str, float]


def agreement(runs: Runs) -> tuple[Agreement, ...]:
    """Compare the runs that have the same scenario, number and seed in both tiers."""
    numbers, seeds = runs.integers("run"), runs.integers("seed")
    tiers: dict[str, dict[str, dict[tuple[int, int], int]]] = {}
    for scenario, tier, rows in runs.groups:
        places = {(int(numbers[row]), int(seeds[row])): int(row) for row in rows}
        tiers.setdefault(scenario, {})[tier] = places
    columns = {measure.name: runs.floats(measure.name) for measure in MEASURES}
    found = []
    for scenario, by_tier in tiers.items():
        if len(by_tier) != 2:
            continue
        first, second = by_tier.values()
        shared = sorted(first.keys() & second.keys())
        one, two = (np.array([places[pair] for pair in shared], dtype=int) for places in (first, second))
        arrived = ~(runs.lost[one] | runs.lost[two])
        differences = {name: np.abs(column[one] - column[two])[arrived] for name, column in columns.items()}
        largest = {
            name: float(np.nanmax(values))
            for name, values in differences.items()
            if np.isfinite(values).any()
        }
        verdicts = int((runs.lost[one] != runs.lost[two]).sum())
        found.append(Agreement(scenario, len(shared), verdicts, largest))
    return tuple(found)
