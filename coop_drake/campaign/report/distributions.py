"""Distributions of margins, time and forces, and the share of lost runs, by scenario and tier."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import nan

import numpy as np

from coop_drake.campaign.report.columns import MEASURES, Runs
from coop_drake.campaign.report.rates import Rate, loss_rate
from coop_drake.tree.pose import FloatArray

_BINS = 30
"""Bins of a histogram [-]: a hill of a figure is some hundred points wide."""

_ROUNDING = 4 * _BINS
"""Values whose range is at most this many units in the last place count as one value [-]."""

_REASONS = 5
"""Reasons for losses that are listed, the most frequent ones."""


@dataclass(frozen=True)
class Distribution:
    """How the values of a column are distributed, in its own unit; numbers are NaN where there are no values.

    Attributes:
        count: Values that are numbers.
        least: Smallest value.
        low: Below it are 5 % of them.
        median: Below it is one half.
        high: Below it are 95 %.
        largest: Largest value.
        heights: Counts of values in bins of equal width from the smallest to the largest value.
    """

    count: int
    least: float
    low: float
    median: float
    high: float
    largest: float
    heights: tuple[int, ...]


NOTHING = Distribution(0, nan, nan, nan, nan, nan, ())
"""The distribution of no values."""


@dataclass(frozen=True)
class Group:
    """The runs of one scenario in one tier.

    Attributes:
        scenario: Name of the scenario.
        tier: Which loop simulated it.
        rate: How many were lost.
        reasons: The most frequent reasons for losses, with their counts.
        measures: Distribution of every column that has numbers, by its name; margins over all runs, times and
            forces over those that arrived.
    """

    scenario: str
    tier: str
    rate: Rate
    reasons: tuple[tuple[str, int], ...]
    measures: dict[str, Distribution]


def distribution(values: FloatArray) -> Distribution | None:
    """Return the distribution of values, NaN left out; None if there are no others."""
    numbers = values[np.isfinite(values)]
    if numbers.size == 0:
        return None
    low, median, high = np.quantile(numbers, (0.05, 0.5, 0.95))
    ends = float(numbers.min()), float(numbers.max())
    return Distribution(
        int(numbers.size), ends[0], float(low), float(median), float(high), ends[1], _heights(numbers, ends)
    )  # fmt: skip


def _heights(numbers: FloatArray, ends: tuple[float, float]) -> tuple[int, ...]:
    """Return the counts in bins between the ends; all in the middle one where these would be rounding."""
    if ends[1] - ends[0] <= _ROUNDING * np.spacing(max(map(abs, ends))):
        return tuple(numbers.size if place == _BINS // 2 else 0 for place in range(_BINS))
    return tuple(int(height) for height in np.histogram(numbers, bins=_BINS, range=ends)[0])


def summarise(runs: Runs, confidence: float) -> tuple[Group, ...]:
    """Return how the runs of every scenario and tier went."""
    columns = {measure: runs.floats(measure.name) for measure in MEASURES}
    groups = []
    for scenario, tier, rows in runs.groups:
        lost = runs.lost[rows]
        known = {
            measure.name: distribution(column[rows] if measure.margin else column[rows][~lost])
            for measure, column in columns.items()
        }
        counted = Counter(runs.text("reason", row) for row in rows[lost])
        groups.append(
            Group(
                scenario,
                tier,
                loss_rate(int(lost.sum()), rows.size, confidence),
                tuple(counted.most_common(_REASONS)),
                {name: values for name, values in known.items() if values is not None},
            )
        )
    return tuple(groups)
