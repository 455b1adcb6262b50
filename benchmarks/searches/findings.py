"""What searches leave: the worst run that one found, and the multiple at which runs are first lost."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite


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
