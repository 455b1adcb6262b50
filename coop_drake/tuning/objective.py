"""What is sought: criteria with weights, within limits; one number for each run, smaller is better."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

from coop_drake.errors import TuningError
from coop_drake.tuning.criteria import CRITERIA
from coop_drake.tuning.trial import Outcome

__all__ = ["Limit", "Objective", "read_weights"]

_LIMITS_BROKEN, _RUN_FAILED = 1e3, 1e6  # What broken limits and failed runs start at; scores stay below.
_LIMIT = re.compile(r"\s*(\w+)\s*(<=|>=)\s*([0-9.eE+-]+)\s*(x?)\s*")


def read_weights(texts: Sequence[str]) -> dict[str, float]:
    """Read criteria such as ``peak_force`` or ``time=0.5``; a criterion without a weight counts once.

    Raises:
        TuningError: A name is no criterion, or a weight no positive number.
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
        at_most: Whether it bounds from above; else from below.
        value: The bound, in the criterion's unit or as a multiple of the value before.
        relative: Whether it is such a multiple.
    """

    criterion: str
    at_most: bool
    value: float
    relative: bool = False

    @classmethod
    def parse(cls, text: str) -> Limit:
        """Read ``time<=16``, ``clearance>=0.1`` or ``time<=1.1x``, which is 1.1 times the value before.

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
        """The bound in the criterion's unit."""
        return self.value * before[self.criterion] if self.relative else self.value

    def excess(self, values: Mapping[str, float], before: Mapping[str, float]) -> float:
        """By how much it is broken, as a share of the bound; 0 if it is kept [-]."""
        bound, value = self.bound(before), values[self.criterion]
        beyond = value - bound if self.at_most else bound - value
        return max(0.0, beyond) / max(abs(bound), 1e-9)


@dataclass(frozen=True)
class Objective:
    """How runs are compared with the run before.

    Attributes:
        weights: Weight of every criterion that counts.
        limits: What every run must keep.
        before: Criteria of the run with the gains there were.
    """

    weights: Mapping[str, float]
    limits: tuple[Limit, ...]
    before: Mapping[str, float]

    def kept(self, outcome: Outcome) -> bool:
        """Whether a run arrived, violated nothing and kept every limit."""
        return outcome.arrived and not any(limit.excess(outcome.values, self.before) for limit in self.limits)

    def score(self, outcome: Outcome) -> float:
        """Weighted mean of all criteria over their values before: 1 for the run before.

        Runs that break a limit count as worse than all that keep them, failed ones as worse than those;
        the less they broke and the further they came, the better.
        """
        if not outcome.arrived:
            return _RUN_FAILED + 1.0 - outcome.share_done
        excess = sum(limit.excess(outcome.values, self.before) for limit in self.limits)
        if excess > 0.0:
            return _LIMITS_BROKEN + excess
        ratios = {name: self._ratio(name, outcome.values[name]) for name in self.weights}
        total = sum(self.weights.values())
        return min(sum(self.weights[name] * ratios[name] for name in ratios) / total, _LIMITS_BROKEN)

    def _ratio(self, name: str, value: float) -> float:
        """How much worse than before: below 1 is better."""
        worse, better = (
            (self.before[name], value) if CRITERIA[name].more_is_better else (value, self.before[name])
        )
        return worse / max(better, 1e-9)
