"""How often runs are lost: the share counted, and the interval in which the true one lies."""

from __future__ import annotations

from dataclasses import dataclass

CONFIDENCE = 0.95
"""Probability with which an interval contains the true share of lost runs, at least [-]."""


@dataclass(frozen=True)
class Rate:
    """A share of lost runs with the interval of Clopper and Pearson.

    Attributes:
        lost: Runs that did not arrive, or broke an invariant.
        runs: Runs counted.
        lower: Lower end of the interval [-].
        upper: Upper end of the interval [-]; where none was lost, all of the error's probability is on this
            side, so that it is 1 - (1 - confidence)^(1 / runs).
        confidence: Probability with which the interval contains the true share, at least [-].
    """

    lost: int
    runs: int
    lower: float
    upper: float
    confidence: float

    @property
    def sentence(self) -> str:
        """What was counted and what follows, in words."""
        sure = f"With {100.0 * self.confidence:g} % confidence"
        if self.lost == 0:
            return f"None of {self.runs:,} runs was lost. {sure}, at most {percent(self.upper)} of them are."
        between = f"between {percent(self.lower)} and {percent(self.upper)}"
        return f"{self.lost:,} of {self.runs:,} runs were lost. {sure}, {between} of them are."


def loss_rate(lost: int, runs: int, confidence: float = CONFIDENCE) -> Rate:
    """Return the share of lost runs with its exact interval (Clopper and Pearson).

    Args:
        lost: Runs that were lost.
        runs: Runs counted, at least one.
        confidence: Probability with which the interval contains the true share, at least [-].

    Raises:
        ValueError: There are no runs, or more are lost than there are.
    """
    from scipy.stats import binomtest

    tested = binomtest(lost, runs, alternative="two-sided" if lost else "less")
    interval = tested.proportion_ci(confidence, method="exact")
    return Rate(lost, runs, float(interval.low), float(interval.high), confidence)


def percent(share: float) -> str:
    """A share in per cent with two significant digits."""
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.3g} %"
