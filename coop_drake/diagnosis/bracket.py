"""Bounds of the change that is needed: an amount proved too little, and one found to be enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from coop_drake.diagnosis.variants import Answer, Outcome


@dataclass(frozen=True)
class Bracket:
    """What was computed about the least amount of a change that makes a problem feasible.

    Attributes:
        refuted: Largest amount that was proved not to be enough; None if none was, not even zero.
        found: Smallest amount with which a channel was found, None if there was none.
        most: Largest amount tried.
        outcome: The outcome at ``found``, None if there was none.
    """

    refuted: float | None
    found: float | None
    most: float
    outcome: Outcome | None

    @property
    def is_refuted(self) -> bool:
        """Whether even the largest amount tried was proved not to be enough."""
        return self.refuted is not None and self.refuted >= self.most


@dataclass(frozen=True)
class Amounts:
    """Which amounts of a change to try.

    Attributes:
        first: First amount; doubled until a channel is found.
        most: Largest amount.
        resolution: The bracket is narrowed until its width is at most the larger of ``resolution`` and
            ``fraction`` times the amount found.
        fraction: See ``resolution`` [-].
        asked: Largest number of amounts that are tried.
    """

    first: float
    most: float
    resolution: float
    fraction: float = 0.125
    asked: int = 12


def bracketed(
    ask: Callable[[float], Outcome],
    amounts: Amounts,
    *,
    refuted: float | None = 0.0,
    improve: Callable[[float, Outcome], tuple[float, Outcome]] = lambda amount, outcome: (amount, outcome),
) -> Bracket:
    """Bracket the least amount of a change that is enough, by doubling and then by bisection.

    More of the change must never make a feasible problem infeasible.

    Args:
        ask: Asks about the problem with an amount of the change.
        amounts: Which amounts to try.
        refuted: Amount that is proved not to be enough beforehand, None if nothing is.
        improve: Given an amount that is enough and its outcome, looks for a smaller one.
    """
    search = _Bracketing(ask, improve, refuted)
    amount = min(amounts.first, amounts.most)
    while not search.step(amount) and amount < amounts.most and search.asked < amounts.asked:
        amount = min(2.0 * amount, amounts.most)
    while search.found is not None and search.asked < amounts.asked:
        wanted = max(amounts.resolution, amounts.fraction * search.found)
        if search.found - search.missed > wanted:
            search.step(0.5 * (search.found + search.missed))
        elif search.unproved - search.proved > wanted:
            search.step(0.5 * (search.unproved + search.proved))
        else:
            break
    return Bracket(search.refuted, search.found, search.most, search.outcome)


class _Bracketing:
    """The amounts asked so far."""

    def __init__(
        self,
        ask: Callable[[float], Outcome],
        improve: Callable[[float, Outcome], tuple[float, Outcome]],
        refuted: float | None,
    ) -> None:
        self._ask, self._improve = ask, improve
        self.refuted = refuted
        self.found: float | None = None
        self.outcome: Outcome | None = None
        self.missed = 0.0  # Largest amount without a channel, proved or not.
        self.unproved = 0.0  # Smallest amount without a channel and without a proof, 0 if there is none.
        self.most, self.asked = 0.0, 0

    @property
    def proved(self) -> float:
        """Largest amount that is proved not to be enough, 0 if there is none."""
        return self.refuted or 0.0

    def step(self, amount: float) -> bool:
        """Ask about one amount; returns whether a channel was found."""
        self.asked += 1
        self.most = max(self.most, amount)
        outcome = self._ask(amount)
        if outcome.answer is Answer.FOUND:
            self.found, self.outcome = self._improve(amount, outcome)
            self.missed, self.unproved = min(self.missed, self.found), min(self.unproved, self.found)
            return True
        self.missed = max(self.missed, amount)
        if outcome.answer is Answer.INFEASIBLE:
            self.refuted = max(amount, self.proved)
            self.unproved = self.unproved if self.unproved > amount else 0.0
        else:
            self.unproved = min(self.unproved or amount, amount)
        return False
