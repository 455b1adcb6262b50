"""The search for the run with the smallest margin, by the covariance matrix adaptation strategy (CMA-ES)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from coop_drake.campaign.records import RunRecord
from coop_drake.tree.pose import FloatArray
from coop_drake.tuning.search import evolution_strategy

Values = Mapping[str, Any]
"""Keys of a scenario with their values."""

_FIRST_STEP = 0.3
"""Standard deviation of the first generation, as a fraction of every number's range [-]: nothing is known of
where the worst departures are."""

LOST = -1.0
"""Margin of a lost run that has none of its own below zero [rad or m]: less than any other."""


@dataclass(frozen=True)
class Worst:
    """What a search found.

    Attributes:
        margins: The margin of every run in the order of the search.
        values: The departures of the run with the smallest one.
        record: The record of this run.
    """

    margins: tuple[float, ...]
    values: Values
    record: RunRecord


def margin_of(record: RunRecord, name: str) -> float:
    """Return a margin of a run, and below zero if the run was lost.

    ``budget_share`` counts as what is left of the budget's stated distance.
    """
    margin = in_column(float(getattr(record, name)), name)
    if record.arrived:
        return margin if isfinite(margin) else np.inf
    return margin if margin < 0.0 else LOST


def in_column(margin: float, name: str) -> float:
    """Return the value of a column for a margin that is driven down; called twice, it gives the margin back.

    Only the used share of a budget is another number than its margin: the margin is what is left of it [-].
    """
    return 1.0 - margin if name == "budget_share" else margin


def search_worst(
    start: FloatArray,
    values_of: Callable[[FloatArray], Values],
    run_all: Callable[[Sequence[Values]], Sequence[RunRecord]],
    *,
    margin: str,
    evaluations: int,
    seed: int,
    progress: Callable[[str, float], None] | None = None,
) -> Worst:
    """Search departures with which a margin becomes as small as possible.

    A lost run ends the search. The result depends on the seed and the number of runs alone.

    Args:
        start: Numbers between 0 and 1 around which the search begins.
        values_of: Returns the departures that such numbers stand for.
        run_all: Simulates runs with departures, and returns their records in the same order.
        margin: Name of the record's column that is driven down.
        evaluations: Largest number of runs.
        seed: Seed of the search.
        progress: Called with the smallest margin so far and the fraction of the runs that are done.

    Raises:
        TuningError: The package ``cma`` is not installed.
    """
    strategy = evolution_strategy(start, evaluations, seed, first_step=_FIRST_STEP)
    first = values_of(start)
    (record,) = run_all([first])
    found = Worst((margin_of(record, margin),), first, record)
    while found.record.arrived and len(found.margins) < evaluations and not strategy.stop():
        asked = strategy.ask()[: evaluations - len(found.margins)]
        chosen = [values_of(fractions) for fractions in asked]
        records = run_all(chosen)
        margins = [margin_of(record, margin) for record in records]
        if len(margins) == strategy.popsize:
            strategy.tell(asked, margins)
        least = int(np.argmin(margins))
        before = min(found.margins)
        values, record = (
            (chosen[least], records[least]) if margins[least] < before else (found.values, found.record)
        )
        found = Worst((*found.margins, *margins), values, record)
        if progress is not None:
            text = f"smallest {margin.replace('_', ' ')} {min(found.margins):.4g}"
            progress(text, len(found.margins) / evaluations)
    return found
