"""What searches and bisections leave, one by one, together, and in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, isnan, nan

import numpy as np

from coop_drake.campaign.report import percent


@dataclass(frozen=True)
class Finding:
    """The worst run that a search found.

    Attributes:
        scenario: Name of the scenario.
        tier: Which loop simulated the runs.
        seed: Seed of the search.
        evaluations: Runs simulated; 0 where processes were lost in the search.
        margin: Name of the column that was driven down, or up if it is ``budget_share``.
        before: Its value in the first run, whose departures were drawn at random [unit of the column].
        worst: Its value in the worst run [unit of the column]. Both are NaN where a run does not tell it, or
            where processes were lost in the search.
        arrived: Whether the worst run arrived; a lost run is worse than all that arrived.
        reason: Why not; empty if it arrived.
        file: Campaign file of the worst run, in the campaign's folder; empty where none was written.
    """

    scenario: str
    tier: str
    seed: int
    evaluations: int
    margin: str
    before: float
    worst: float
    arrived: bool
    reason: str = ""
    file: str = ""


@dataclass(frozen=True)
class BreakingPoint:
    """The multiple of a certified departure at which runs are first lost, found by bisection.

    Attributes:
        scenario: Name of the scenario.
        tier: Which loop simulated the runs.
        departure: Name of the departure.
        certified: What is certified, in the departure's unit; the runs have this times the multiple. NaN
            where processes were lost in the bisection, which then found nothing.
        kept: Largest multiple tried at which no run was lost [-]; below 1 where one was lost inside what is
            certified.
        lost: Smallest multiple tried at which a run was lost [-]; infinity where none was.
        runs: Runs at every multiple.
        reason: Why the first run was lost.
    """

    scenario: str
    tier: str
    departure: str
    certified: float
    kept: float
    lost: float
    runs: int
    reason: str

    @property
    def beyond(self) -> float | None:
        """The smallest multiple at which a run was lost; None where none was."""
        return self.lost if isfinite(self.lost) else None


UNKNOWN = "not determined"
"""What stands in place of a multiple where a bisection found none."""


def is_determined(point: BreakingPoint) -> bool:
    """Whether a bisection came to an end; it did not where its process was lost or no multiple was tried."""
    return not isnan(point.certified) and (point.kept >= 1.0 or isfinite(point.lost))


def is_good(point: BreakingPoint) -> bool:
    """Whether no run was lost at what is certified."""
    return is_determined(point) and point.kept >= 1.0


def multiple_shown(point: BreakingPoint | None) -> str:
    """The largest multiple at which no run was lost, in words; empty without a bisection."""
    if point is None:
        return ""
    if not is_determined(point):
        return UNKNOWN
    return f"{point.kept:.3g}" if point.beyond else f"{point.kept:.3g} or more"


def ends_shown(point: BreakingPoint) -> tuple[str, str, str]:
    """What is certified, up to where no run was lost, and where one was, in the departure's unit."""
    certified = UNKNOWN if isnan(point.certified) else f"{point.certified:.4g}"
    if not is_determined(point):
        return certified, UNKNOWN, UNKNOWN
    lost = f"{point.lost * point.certified:.3g}" if point.beyond else "not found"
    return certified, f"{point.kept * point.certified:.3g}", lost


def sentences(points: Sequence[BreakingPoint]) -> tuple[str, ...]:
    """Say what is bad of bisections; if nothing is, up to which multiple all of them lost no run."""
    determined = [point for point in points if is_determined(point)]
    told = []
    if inside := [point for point in determined if not is_good(point)]:
        least = min(inside, key=lambda point: point.lost)
        told.append(f"A run was lost at {least.lost:.2g} times what is certified ({_name(least)}).")
    if unknown := [point for point in points if not is_determined(point)]:
        several = "1 breaking point is" if len(unknown) == 1 else f"{len(unknown):,} breaking points are"
        told.append(f"{several} {UNKNOWN} ({_name(unknown[0])}{', ...' if len(unknown) > 1 else ''}).")
    if points and not told:
        least = min(points, key=lambda point: point.kept)
        told.append(f"No run was lost up to {least.kept:.2g} times what is certified ({_name(least)}).")
    return tuple(told)


def _name(point: BreakingPoint) -> str:
    return f"{point.departure.replace('_', ' ')}, {point.scenario}"


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
