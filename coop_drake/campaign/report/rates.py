"""How often runs are lost: the share counted, and the bound below which the true one lies."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import ROUND_CEILING, Context, Decimal

CONFIDENCE = 0.95
"""Probability with which the true share of lost runs is not above its bound, at least [-]."""


@dataclass(frozen=True)
class Rate:
    """A share of lost runs with the upper bound of Clopper and Pearson.

    Attributes:
        lost: Runs that did not arrive, or broke an invariant.
        runs: Runs counted.
        upper: Upper bound of the true share; all of the error's probability is on this side, however many
            were lost, so that it is 1 - (1 - confidence)^(1 / runs) where none was [-].
        confidence: Probability with which the true share is not above the bound, at least [-].
    """

    lost: int
    runs: int
    upper: float
    confidence: float

    @property
    def sentence(self) -> str:
        """What was counted and what follows, in words."""
        counted = f"None of {self.runs:,} runs was lost."
        if self.lost:
            share, were = percent(self.lost / self.runs), "was" if self.lost == 1 else "were"
            counted = f"{self.lost:,} of {self.runs:,} runs {were} lost, {share}."
        sure = f"With {100.0 * self.confidence:g} % confidence"
        return f"{counted} {sure}, at most {percent_up(self.upper)} of them are."


def loss_rate(lost: int, runs: int, confidence: float = CONFIDENCE) -> Rate:
    """Return the share of lost runs with its exact upper bound (Clopper and Pearson).

    The bound has the same form whatever was counted: one that is chosen after the runs were counted would be
    wrong more often than it says.

    Args:
        lost: Runs that were lost.
        runs: Runs counted, at least one.
        confidence: Probability with which the true share is not above the bound, at least [-].

    Raises:
        ValueError: There are no runs, or more are lost than there are.
    """
    from scipy.stats import binomtest

    interval = binomtest(lost, runs, alternative="less").proportion_ci(confidence, method="exact")
    return Rate(lost, runs, float(interval.high), confidence)


def percent(share: float) -> str:
    """A share in per cent with two significant digits."""
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.3g} %"


def percent_up(share: float) -> str:
    """An upper bound in per cent, rounded up to two significant digits, and to three from 99 % on."""
    exact = Decimal(repr(float(share))) * 100
    return f"{float(Context(2 if share <= 0.99 else 3, ROUND_CEILING).plus(exact)):.3g} %"
