"""How much of a change is needed: a proof that so much is not enough, and a channel with so much."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from coop_drake.diagnosis.trials import Answer, Trial

__all__ = ["Bracket", "Steps", "bracketed"]


@dataclass(frozen=True)
class Bracket:
    """What was computed about the least amount of a change that makes a question feasible.

    Attributes:
        refuted: Largest amount that was proved not to be enough; None if none was, not even zero.
        found: Smallest amount with which a channel was found, None if there was none.
        most: Largest amount tried.
        trial: The trial at ``found``, None if there was none.
    """

    refuted: float | None
    found: float | None
    most: float
    trial: Trial | None

    @property
    def is_refuted(self) -> bool:
        """Whether even the largest amount tried was proved not to be enough."""
        return self.refuted is not None and self.refuted >= self.most


@dataclass(frozen=True)
class Steps:
    """Which amounts to try.

    Attributes:
        first: First amount; doubled until a channel is found.
        most: Largest amount.
        resolution: The bracket is narrowed down to this.
        share: Or to this share of the amount found, if that is more [-].
        trials: How many amounts are tried at most.
    """

    first: float
    most: float
    resolution: float
    share: float = 0.125
    trials: int = 12


def bracketed(
    ask: Callable[[float], Trial],
    steps: Steps,
    *,
    refuted: float | None = 0.0,
    improve: Callable[[float, Trial], tuple[float, Trial]] = lambda amount, trial: (amount, trial),
) -> Bracket:
    """Bracket the least amount of a change, more of which never makes a feasible question infeasible.

    Args:
        ask: Puts the question with an amount of the change.
        steps: Which amounts to try.
        refuted: Amount that is proved not to be enough beforehand, None if nothing is.
        improve: Given an amount that is enough and its trial, looks for a smaller one.
    """
    search = _Search(ask, improve, refuted)
    amount = min(steps.first, steps.most)
    while not search.step(amount) and amount < steps.most and search.asked < steps.trials:
        amount = min(2.0 * amount, steps.most)
    while search.found is not None and search.asked < steps.trials:
        wanted = max(steps.resolution, steps.share * search.found)
        if search.found - search.missed > wanted:
            search.step(0.5 * (search.found + search.missed))
        elif search.unproved - search.proved > wanted:
            search.step(0.5 * (search.unproved + search.proved))
        else:
            break
    return Bracket(search.refuted, search.found, search.most, search.trial)


class _Search:
    """The amounts asked so far."""

    def __init__(
        self,
        ask: Callable[[float], Trial],
        improve: Callable[[float, Trial], tuple[float, Trial]],
        refuted: float | None,
    ) -> None:
        self._ask, self._improve = ask, improve
        self.refuted = refuted
        self.found: float | None = None
        self.trial: Trial | None = None
        self.missed = 0.0  # Largest amount without a channel, proved or not.
        self.unproved = 0.0  # Smallest amount without a channel and without a proof, 0 if there is none.
        self.most, self.asked = 0.0, 0

    @property
    def proved(self) -> float:
        """Largest amount that is proved not to be enough, 0 if there is none."""
        return self.refuted or 0.0

    def step(self, amount: float) -> bool:
        """Ask with one amount; returns whether a channel was found."""
        self.asked += 1
        self.most = max(self.most, amount)
        trial = self._ask(amount)
        if trial.answer is Answer.FOUND:
            self.found, self.trial = self._improve(amount, trial)
            self.missed, self.unproved = min(self.missed, self.found), min(self.unproved, self.found)
            return True
        self.missed = max(self.missed, amount)
        if trial.answer is Answer.INFEASIBLE:
            self.refuted = max(amount, self.proved)
            self.unproved = self.unproved if self.unproved > amount else 0.0
        else:
            self.unproved = min(self.unproved or amount, amount)
        return False
