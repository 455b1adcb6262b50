"""What the searches of a scenario found together, and in a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, isnan, nan

import numpy as np

from benchmarks.searches.findings import Finding
from coop_drake.campaign.report.rates import percent


@dataclass(frozen=True)
class Searched:
    """The searches of one scenario for one margin in one tier.

    Attributes:
        scenario: Name of the scenario.
        tier: Which loop simulated the runs.
        margin: Name of the column that was driven down, or up if it is ``budget_share``.
        searches: Number of searches, those that could not be made with them.
        failed: Searches that could not be made, for their processes were lost.
        runs: Runs of all of them.
        lost: Searches that found a lost run.
        before: Median of the first runs' values that are known; NaN if none is [unit of the column].
        typical: Median of the worst values that are known; NaN if none is [unit of the column].
        worst: The finding with the worst value of all; a lost run if there is one, and a search that could
            not be made if there is no other.
    """

    scenario: str
    tier: str
    margin: str
    searches: int
    failed: int
    runs: int
    lost: int
    before: float
    typical: float
    worst: Finding


def is_made(one: Finding) -> bool:
    """Whether a search came to an end; it did not where its process was lost."""
    return one.evaluations > 0


def found_loss(one: Finding) -> bool:
    """Whether a search found a lost run."""
    return is_made(one) and not one.arrived


def summarise_searches(findings: Sequence[Finding]) -> tuple[Searched, ...]:
    """Return what searches found by scenario, tier and margin, in the order in which these come first."""
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for one in findings:
        groups.setdefault((one.scenario, one.tier, one.margin), []).append(one)
    return tuple(_summary(key, group) for key, group in groups.items())


def _summary(key: tuple[str, str, str], group: Sequence[Finding]) -> Searched:
    made = [one for one in group if is_made(one)]
    sign = -1.0 if key[2] == "budget_share" else 1.0
    return Searched(
        *key,
        searches=len(group),
        runs=sum(one.evaluations for one in group),
        failed=len(group) - len(made),
        lost=sum(map(found_loss, group)),
        before=_median([one.before for one in made]),
        typical=_median([one.worst for one in made]),
        worst=min(made or group, key=lambda one: (one.arrived, isnan(one.worst), sign * one.worst)),
    )


def _median(values: Sequence[float]) -> float:
    """The median of the values that are numbers; NaN if there are none."""
    known = [value for value in values if isfinite(value)]
    return float(np.median(known)) if known else nan


def sentence(findings: Sequence[Finding]) -> str:
    """Say how many searches found a lost run, how many could not be made, and what of the budget was used."""
    made = [one for one in findings if is_made(one)]
    lost, runs = sum(map(found_loss, made)), sum(one.evaluations for one in made)
    told = []
    if made:
        number = f"{lost:,}" if lost else "None"
        told.append(f"{number} of {_searches(len(made))}, with {runs:,} runs, found a run that is lost.")
    if failed := len(findings) - len(made):
        told.append(f"{_searches(failed)} could not be made.")
    used = [one.worst for one in made if one.margin == "budget_share" and one.worst > 1.0]
    if used:
        most = percent(max(used))
        told.append(f"{_searches(len(used))} used more than the budget states, up to {most} of it.")
    return " ".join(told)


def _searches(count: int) -> str:
    return "1 search" if count == 1 else f"{count:,} searches"
