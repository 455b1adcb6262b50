"""All numbers of a report, gathered once for the page and for machines."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from coop_drake.campaign.report.columns import SHARE, Runs
from coop_drake.campaign.report.distributions import Group, summarise
from coop_drake.campaign.report.rates import CONFIDENCE, Rate, loss_rate
from coop_drake.campaign.report.worst import WorstRun, worst_runs


@dataclass(frozen=True)
class Report:
    """What a campaign found.

    Attributes:
        title: Name of the campaign.
        facts: What was asked for: name and value, in the order shown.
        rate: How many of all runs were lost; None without runs. Here and in the next number a run that both
            tiers made counts once: it has the same values and the same seed in both, and is lost if it was
            lost in any.
        exceeded: Runs that used more than all of what the budget states, lost or not.
        most_used: Largest share of what the budget states that a run used; NaN where none is known [-].
        groups: The runs of every scenario and tier.
        worst: The worst runs.
        missing: Batches of the campaign that are not made yet. Slow ones come last: what is there is not a
            random sample of what was asked for.
    """

    title: str
    facts: tuple[tuple[str, str], ...]
    rate: Rate | None
    exceeded: int
    most_used: float
    groups: tuple[Group, ...]
    worst: tuple[WorstRun, ...]
    missing: int

    def to_json(self) -> str:
        """Return all numbers as JSON; numbers that are not finite are null."""
        return json.dumps(_finite(asdict(self)), indent=1, ensure_ascii=False) + "\n"


def make_report(
    title: str,
    runs: Any = None,
    *,
    facts: Sequence[tuple[str, str]] = (),
    missing: int = 0,
    confidence: float = CONFIDENCE,
) -> Report:
    """Compute a report from the table of a campaign's runs.

    Args:
        title: Name of the campaign.
        runs: A pyarrow table with the columns of ``RunRecord``, None for no runs.
        facts: What was asked for: name and value.
        missing: Batches of the campaign that are not made yet.
        confidence: Probability with which a true rate is not above its bound, at least [-].
    """
    known = None if runs is None or runs.num_rows == 0 else Runs(runs)
    used = np.empty(0) if known is None else known.floats(SHARE)
    return Report(
        title,
        tuple(facts),
        None
        if known is None
        else loss_rate(known.count_trials(known.lost), known.count_trials(), confidence),
        0 if known is None else known.count_trials(used > 1.0),
        float(np.nanmax(used)) if np.isfinite(used).any() else math.nan,
        () if known is None else summarise(known, confidence),
        () if known is None else worst_runs(known),
        missing,
    )


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
