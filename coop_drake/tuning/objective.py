"""What is sought: criteria of runs, limits that they keep, and one score for each run; smaller is better."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Literal

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.errors import TuningError
from coop_drake.laws import GainSet

_LIMITS_BROKEN = 1e3
"""Smallest score of a run that breaks a limit; runs that keep all limits stay below [-]."""

_RUN_FAILED = 1e6
"""Smallest score of a run that fails; runs that arrive stay below [-]."""

_LIMIT = re.compile(r"\s*(\w+)\s*(<=|>=)\s*([0-9.eE+-]+)\s*(x?)\s*")


@dataclass(frozen=True)
class Criterion:
    """One number by which runs are compared.

    Attributes:
        name: Name on the command line and in files.
        label: Name in tables and figures.
        unit: Unit of the number.
        measure: Computes the number from the log of a run.
        more_is_better: Whether larger numbers are better, as for margins.
    """

    name: str
    label: str
    unit: str
    measure: Callable[[SimulationLog], float]
    more_is_better: bool = False


def _base_forces(log: SimulationLog) -> np.ndarray:
    """Return the force of every base at every accepted step, shape (T, N) [N]."""
    return np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1])


def _mean_force(log: SimulationLog) -> float:
    """Return the root mean square force over time and bases; steps differ in length and are weighted [N]."""
    squares = (_base_forces(log) ** 2).mean(axis=1)
    return float(np.sqrt(np.trapezoid(squares, log.times) / log.times[-1]))


def _turning(log: SimulationLog) -> float:
    """Return the largest mean angular acceleration of the object over an accepted step [rad/s^2]."""
    steps = np.diff(log.times)
    moved = steps > 0.0
    return float(np.abs(np.diff(log.object_twist[:, 2])[moved] / steps[moved]).max(initial=0.0))


CRITERIA = {
    criterion.name: criterion
    for criterion in (
        Criterion("time", "duration", "s", lambda log: float(log.times[-1])),
        Criterion("peak_force", "peak base force", "N", lambda log: float(_base_forces(log).max())),
        Criterion("force_rate", "peak rate of base forces", "N/s", lambda log: log.peak_force_rate),
        Criterion("mean_force", "root mean square base force", "N", _mean_force),
        Criterion(
            "peak_base_torque",
            "peak base torque",
            "N m",
            lambda log: float(np.abs(log.base_wrenches[..., 2]).max()),
        ),
        Criterion(
            "peak_torque",
            "peak joint torque",
            "N m",
            lambda log: float(np.abs(log.joint_torques).max(initial=0.0)),
        ),
        Criterion("peak_turning", "peak angular acceleration", "rad/s²", _turning),
        Criterion(
            "clearance",
            "clearance to walls and bodies",
            "m",
            lambda log: float(min(log.workspace_clearance.min(), log.body_clearance.min())),
            more_is_better=True,
        ),
        Criterion(
            "cell_margin",
            "margin to the cells' boundaries",
            "m",
            lambda log: float(log.cell_clearance.min()),
            more_is_better=True,
        ),
        Criterion(
            "funnel_margin",
            "margin to the funnel bounds",
            "rad",
            lambda log: float(log.funnel_margin.min()),
            more_is_better=True,
        ),
    )
}
"""All criteria by name."""


@dataclass(frozen=True)
class TrialOutcome:
    """Result of a simulated run.

    Attributes:
        arrived: Whether the object came to rest at the goal and no invariant was violated.
        fraction_done: Fraction of the plan's cells that were passed [-].
        values: Value of every criterion by name.
        violation: The invariant that was violated; empty if none was.
    """

    arrived: bool
    fraction_done: float
    values: Mapping[str, float]
    violation: str


def outcome_of(log: SimulationLog, cells: int) -> TrialOutcome:
    """Measure a run of a plan with so many cells by every criterion."""
    arrived = log.reached and not log.violation
    done = 1.0 if arrived else float(log.cell_index[-1]) / cells
    values = {name: criterion.measure(log) for name, criterion in CRITERIA.items()}
    return TrialOutcome(arrived, done, values, log.violation)


@dataclass(frozen=True)
class GainTrial:
    """A gain set and the result of its run.

    Attributes:
        gains: The gain set.
        outcome: Result of the run.
        loop: The loop that was run, Drake's or the compiled one.
    """

    gains: GainSet
    outcome: TrialOutcome
    loop: Literal["drake", "compiled"] = "drake"


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

    def kept(self, outcome: TrialOutcome) -> bool:
        """Whether a run arrived and kept every limit."""
        return outcome.arrived and not any(limit.excess(outcome.values, self.before) for limit in self.limits)

    def score(self, outcome: TrialOutcome) -> float:
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
