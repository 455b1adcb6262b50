"""The search for gains by the covariance matrix adaptation evolution strategy (CMA-ES).

It uses the order of the scores alone, so that limits and failed runs need no tuned penalties, and it begins
around the current gains. A generation has about a dozen runs; strategies that first sample the whole range of
every gain need many more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np

from coop_drake.errors import TuningError
from coop_drake.extras import install_advice
from coop_drake.laws import GainSet
from coop_drake.tuning.objective import Objective
from coop_drake.tuning.parameters import Parameter, to_fractions, with_fractions
from coop_drake.tuning.trial import GainTrial

_FIRST_STEP = 0.15
"""Standard deviation of the first generation, as a fraction of every gain's logarithmic range [-]."""

TryAll = Callable[[Sequence[GainSet]], Iterable[GainTrial]]


@dataclass
class Search:
    """All trials in order; the first is the run before tuning.

    Attributes:
        objective: Gives the score of a trial.
        trials: The trials.
        scores: Score of every trial.
        interrupted: Whether Ctrl-C ended the search.
    """

    objective: Objective
    trials: list[GainTrial] = field(default_factory=list)
    scores: list[float] = field(default_factory=list)
    interrupted: bool = False

    def add(self, trial: GainTrial) -> float:
        """Append a trial, and return its score."""
        self.trials.append(trial)
        self.scores.append(self.objective.score(trial.outcome))
        return self.scores[-1]

    @property
    def best(self) -> GainTrial:
        """The trial with the smallest score; the first one if several have it."""
        return self.trials[int(np.argmin(self.scores))]


def search(
    before: GainTrial,
    parameters: Sequence[Parameter],
    objective: Objective,
    try_all: TryAll,
    *,
    runs: int,
    seed: int,
    progress: Callable[[str, float], None] | None = None,
) -> Search:
    """Search gains with a smaller score.

    The result depends on the seed and the number of runs, not on the number of processes: every generation is
    simulated as a whole before the next is made. Ctrl-C ends the search and keeps the trials so far.

    Args:
        before: Trial of the current gains.
        parameters: Gains that may change.
        objective: Gives the score of a trial.
        try_all: Simulates gain sets; yields their trials in the same order.
        runs: Largest number of trials, besides ``before``.
        seed: Seed of the search.
        progress: Called with the best score so far and the fraction of the runs that are done.

    Raises:
        TuningError: The package ``cma`` is not installed.
    """
    found = Search(objective)
    found.add(before)
    strategy = evolution_strategy(to_fractions(before.gains, parameters), runs, seed)
    try:
        while len(found.trials) <= runs and not strategy.stop():
            asked = strategy.ask()[: runs + 1 - len(found.trials)]
            scores = []
            for trial in try_all(
                [with_fractions(before.gains, parameters, fractions) for fractions in asked]
            ):
                scores.append(found.add(trial))
                if progress is not None:
                    progress(f"best score {min(found.scores):.3f}", (len(found.trials) - 1) / runs)
            if len(scores) == strategy.popsize:
                strategy.tell(asked, scores)
    except KeyboardInterrupt:
        found.interrupted = True
    return found


def load_optimizer() -> Any:
    """Import and return the package ``cma``, which is not installed with coop_drake itself.

    Raises:
        TuningError: It is not installed.
    """
    try:
        return import_module("cma")
    except ImportError as error:
        message = f"tuning needs the package cma, which is not installed: {install_advice('cma')}"
        raise TuningError(message) from error


def evolution_strategy(start: np.ndarray, runs: int, seed: int, *, first_step: float = _FIRST_STEP) -> Any:
    """Return a strategy for numbers between 0 and 1, ready for its first generation.

    Args:
        start: Where it begins.
        runs: Largest number of trials.
        seed: Its seed; numpy's global generator is not touched.
        first_step: Standard deviation of the first generation [-].

    Raises:
        TuningError: The package ``cma`` is not installed.
    """
    random = np.random.default_rng(seed)
    options = {
        "bounds": [0.0, 1.0],
        "seed": np.nan,  # A number would seed numpy's global generator; `randn` is used instead.
        "randn": lambda *shape: random.standard_normal(shape),
        "maxfevals": runs,
        "verbose": -9,
    }
    return load_optimizer().CMAEvolutionStrategy(start, first_step, options)
