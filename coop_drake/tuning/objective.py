"""The objective of tuning: weighted criteria within limits, as one score for each run; smaller is better."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

from coop_drake.errors import TuningError
from coop_drake.tuning.criteria import CRITERIA
from coop_drake.tuning.trial import RunOutcome

_LIMITS_BROKEN = 1e3
"""Smallest score of a run that breaks a limit; runs that keep all limits stay below [-]."""

_RUN_FAILED = 1e6
"""Smallest score of a run that fails; runs that arrive stay below [-]."""

_LIMIT = re.compile(r"\s*(\w+)\s*(<=|>=)\s*([0-9.eE+-]+)\s*(x?)\s*")


def read_weights(texts: Sequence[str]) -> dict[str, float]:
    """Read criteria such as ``peak_force`` or ``time=0.5``; the weight is 1 where none is given.

    Raises:
        TuningError: A name is no criterion, or a weight is no positive number.
    """
    weights = {}
    for text in texts:
        name, _, weight = text.partition("=")
        if name not in CRITERIA:
            raise TuningError(
                f"--criterion {text}: expected one of {', '.join(CRITERIA)}, and =WEIGHT if wanted"
            )
        weights[name] = _number(weight or "1", f"--criterion {text}")
        if not 0.0 < weights[name] < inf:
            raise TuningError(f"--criterion {text}: expected a positive weight")
    return weights


def _number(text: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise TuningError(f"{where}: {text} is no number") from None


@dataclass(frozen=True)
class Limit:
    """A bound that a run has to keep.

    Attributes:
        criterion: Name of the criterion.
        at_most: Whether it is an upper bound; else it is a lower one.
        value: The bound, in the criterion's unit or as a multiple of the value before tuning.
        relative: Whether it is such a multiple.
    """

    criterion: str
    at_most: bool
    value: float
    relative: bool = False

    @classmethod
    def parse(cls, text: str) -> Limit:
        """Read ``time<=16``, ``clearance>=0.1`` or ``time<=1.1x`` (1.1 times the value before tuning).

        Raises:
            TuningError: The text is none of these.
        """
        match = _LIMIT.fullmatch(text)
        if match is None:
            raise TuningError(f"--limit {text}: expected such as time<=16, clearance>=0.1 or time<=1.1x")
        name, sense, number, relative = match.groups()
        if name not in CRITERIA:
            raise TuningError(
                f"--limit {text}: {name} is no criterion; expected one of {', '.join(CRITERIA)}"
            )
        return cls(name, sense == "<=", _number(number, f"--limit {text}"), bool(relative))

    def bound(self, before: Mapping[str, float]) -> float:
        """Return the bound in the criterion's unit."""
        return self.value * before[self.criterion] if self.relative else self.value

    def excess(self, values: Mapping[str, float], before: Mapping[str, float]) -> float:
        """Return by which fraction of the bound it is broken, 0 if it is kept [-]."""
        bound, value = self.bound(before), values[self.criterion]
        beyond = value - bound if self.at_most else bound - value
        return max(0.0, beyond) / max(abs(bound), 1e-9)


@dataclass(frozen=True)
class Objective:
    """Compares runs with the run before tuning.

    Attributes:
        weights: Weight of every criterion that counts.
        limits: Bounds that every run must keep.
        before: Value of every criterion in the run before tuning.
    """

    weights: Mapping[str, float]
    limits: tuple[Limit, ...]
    before: Mapping[str, float]

    def kept(self, outcome: RunOutcome) -> bool:
        """Whether a run arrived and kept every limit."""
        return outcome.arrived and not any(limit.excess(outcome.values, self.before) for limit in self.limits)

    def score(self, outcome: RunOutcome) -> float:
        """Return the weighted mean of all criteria, each divided by its value before tuning.

        The run before tuning scores 1. A run that breaks a limit scores more than all that keep them, a
        failed run more than those. A smaller excess, and a larger fraction of the transport, score less.
        """
        if not outcome.arrived:
            return _RUN_FAILED + 1.0 - outcome.fraction_done
        excess = sum(limit.excess(outcome.values, self.before) for limit in self.limits)
        if excess > 0.0:
            return _LIMITS_BROKEN + excess
        ratios = {name: self._ratio(name, outcome.values[name]) for name in self.weights}
        total = sum(self.weights.values())
        return min(sum(self.weights[name] * ratios[name] for name in ratios) / total, _LIMITS_BROKEN)

    def _ratio(self, name: str, value: float) -> float:
        """Return the ratio of a criterion to its value before tuning; below 1 is better."""
        worse, better = (
            (self.before[name], value) if CRITERIA[name].more_is_better else (value, self.before[name])
        )
        return worse / max(better, 1e-9)
