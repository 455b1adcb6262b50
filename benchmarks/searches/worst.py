"""The search for the run with the smallest margin, by the covariance matrix adaptation strategy (CMA-ES)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
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


@dataclass(frozen=True)
class Worst:
    """What a search found.

    Attributes:
        margins: The margin of every run in the order of the search; infinite where a run does not tell it.
        values: The departures of a lost run if there is one, else those of the run with the smallest margin.
        record: The record of this run.
        first: The record of the first run.
    """

    margins: tuple[float, ...]
    values: Values
    record: RunRecord
    first: RunRecord


def margin_of(record: RunRecord, name: str) -> float:
    """Return the margin of a run that a search drives down; infinite where the run does not tell it.

    ``budget_share`` counts as what is left of the budget's stated distance.
    """
    value = float(getattr(record, name))
    margin = 1.0 - value if name == "budget_share" else value
    return margin if isfinite(margin) else np.inf


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
    found = Worst((margin_of(record, margin),), first, record, record)
    while found.record.arrived and len(found.margins) < evaluations and not strategy.stop():
        asked = strategy.ask()[: evaluations - len(found.margins)]
        chosen = [values_of(fractions) for fractions in asked]
        records = run_all(chosen)
        margins = [margin_of(record, margin) for record in records]
        if len(margins) == strategy.popsize:
            strategy.tell(asked, margins)
        found = _worse(found, chosen, records, margins)
        if progress is not None:
            text = f"smallest {margin.replace('_', ' ')} {min(found.margins):.4g}"
            progress(text, len(found.margins) / evaluations)
    return found


def _worse(
    found: Worst, chosen: Sequence[Values], records: Sequence[RunRecord], margins: Sequence[float]
) -> Worst:
    """Add runs to what was found. Any lost run is worse than all that arrived, whatever their margins."""
    ranks = [(record.arrived, margin) for record, margin in zip(records, margins, strict=True)]
    worst = min(range(len(ranks)), key=ranks.__getitem__)
    all_margins = (*found.margins, *margins)
    if ranks[worst] < (found.record.arrived, min(found.margins)):
        return Worst(all_margins, chosen[worst], records[worst], found.first)
    return replace(found, margins=all_margins)
