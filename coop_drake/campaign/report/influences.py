"""Which of the keys that vary takes away which margin."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np

from coop_drake.campaign.report.columns import MARGINS, Runs
from coop_drake.tree.pose import FloatArray

_PARTS = 5
"""Into how many parts with equally many runs the values of a key are cut [-]."""

_FEWEST = 20
"""Runs below which nothing is said about a key [-]: a part would have less than four."""

_CHANCE = 0.01
"""Share of campaigns in which chance alone may give a difference that counts [-]."""


@dataclass(frozen=True)
class Influence:
    """How a margin depends on a key that varies, in units of the column.

    Margins are taken relative to the median of their scenario, so that all runs count together.

    Attributes:
        key: Dotted path of the key in the scenario.
        measure: Name of the margin's column.
        chance: Probability with which chance alone lets the parts differ as much, by the test of Kruskal and
            Wallis [-].
        clear: Whether chance alone lets the parts of any key and margin differ as much in less than one
            campaign in a hundred.
        values: Median of the key in every part, in rising order.
        margins: Median of the margin in every part, relative to that of all runs.
    """

    key: str
    measure: str
    chance: float
    clear: bool
    values: tuple[float, ...]
    margins: tuple[float, ...]

    @property
    def taken(self) -> float:
        """How much less of the margin the worst part of the runs has than the best."""
        return max(self.margins) - min(self.margins)

    @property
    def worst(self) -> float:
        """The key's median in the part of the runs that has least of the margin."""
        return self.values[int(np.argmin(self.margins))]


def influences(runs: Runs) -> tuple[Influence, ...]:
    """Return how every margin depends on every key that varies and is a number, sorted by key.

    Of tiers that simulated the same runs, one counts: the one with more runs.
    """
    keys = _varied(runs)
    chance = _CHANCE / max(1, len(keys) * len(MARGINS))
    tiers: Counter[str] = Counter()
    for _, tier, rows in runs.groups:
        tiers[tier] += rows.size
    counted = [rows for _, tier, rows in runs.groups if tier == tiers.most_common(1)[0][0]]
    found = []
    for measure in MARGINS:
        column, margins = runs.floats(measure.name), np.full(runs.count, np.nan)
        for rows in counted:
            known = column[rows][np.isfinite(column[rows])]
            margins[rows] = column[rows] - (np.median(known) if known.size else np.nan)
        for key, values in keys.items():
            both = np.isfinite(values) & np.isfinite(margins)
            found.append(_influence(key, measure.name, values[both], margins[both], chance))
    return tuple(sorted((one for one in found if one is not None), key=lambda one: one.key))


def _influence(
    key: str, measure: str, values: FloatArray, margins: FloatArray, largest: float
) -> Influence | None:
    """Return how a margin depends on a key, clearly if chance is below the largest; None if it is not known.

    The parts are compared, not the ranks of key and margin, so that a margin that falls to both sides counts.
    """
    from scipy.stats import kruskal

    if values.size < _FEWEST or np.ptp(values) == 0.0 or np.ptp(margins) == 0.0:
        return None
    parts = np.array_split(np.argsort(values, kind="stable"), _PARTS)
    chance = float(kruskal(*(margins[part] for part in parts)).pvalue)
    return Influence(
        key,
        measure,
        chance,
        chance < largest,
        tuple(float(np.median(values[part])) for part in parts),
        tuple(float(np.median(margins[part])) for part in parts),
    )


def _varied(runs: Runs) -> dict[str, FloatArray]:
    """Return the values of every key that varies, NaN in runs in which it is no number, shape (runs,)."""
    columns: dict[str, FloatArray] = {}
    for row, text in enumerate(runs.texts("values")):
        chosen: dict[str, Any] = json.loads(text) if text else {}
        for key, value in chosen.items():
            if isinstance(value, int | float) and not isinstance(value, bool):
                if key not in columns:
                    columns[key] = np.full(runs.count, np.nan)
                columns[key][row] = value
    return columns
