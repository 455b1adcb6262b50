"""The search for gains by the covariance matrix adaptation evolution strategy (CMA-ES).

It looks at the order of scores alone, so limits and failed runs need no tuned penalties, and it begins around
the gains there are. A generation of about a dozen runs learns more than one of a population that must cover
every gain's whole range first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import cma
import numpy as np

from coop_drake.laws import GainSet
from coop_drake.tuning.knobs import Knob, decoded, encoded
from coop_drake.tuning.objective import Objective
from coop_drake.tuning.trial import Trial

__all__ = ["Search", "search"]

_FIRST_STEP = 0.15
"""How far the first generation spreads, as a share of every knob's logarithmic range [-]."""

TryAll = Callable[[Sequence[GainSet]], Iterable[Trial]]


@dataclass
class Search:
    """All that was tried, in order; the first is what there was before.

    Attributes:
        objective: How trials are compared.
        trials: What was tried.
        scores: Score of every trial.
        interrupted: Whether the search was ended by Ctrl-C.
    """

    objective: Objective
    trials: list[Trial] = field(default_factory=list)
    scores: list[float] = field(default_factory=list)
    interrupted: bool = False

    def add(self, trial: Trial) -> float:
        """Keep a trial; return its score."""
        self.trials.append(trial)
        self.scores.append(self.objective.score(trial.outcome))
        return self.scores[-1]

    @property
    def best(self) -> Trial:
        """The first of the best trials."""
        return self.trials[int(np.argmin(self.scores))]


def search(
    before: Trial,
    knobs: Sequence[Knob],
    objective: Objective,
    try_all: TryAll,
    *,
    budget: int,
    seed: int,
    progress: Callable[[str, float], None] | None = None,
) -> Search:
    """Look for gains with a smaller score.

    The result depends on the seed and the budget, not on how trials are spread over processes: a generation
    is tried as a whole before the next is asked for. Ctrl-C ends the search with what was found.

    Args:
        before: The gains there are, tried.
        knobs: Gains that may be turned.
        objective: What is sought.
        try_all: Tries gain sets; gives results in their order.
        budget: How many trials at most, besides ``before``.
        seed: Seed of the search.
        progress: Told the best score so far and the share of the budget that is spent.
    """
    found = Search(objective)
    found.add(before)
    strategy = _strategy(encoded(before.gains, knobs), budget, seed)
    try:
        while len(found.trials) <= budget and not strategy.stop():
            asked = strategy.ask()[: budget + 1 - len(found.trials)]
            scores = []
            for trial in try_all([decoded(before.gains, knobs, shares) for shares in asked]):
                scores.append(found.add(trial))
                if progress is not None:
                    progress(f"best score {min(found.scores):.3f}", (len(found.trials) - 1) / budget)
            if len(scores) == strategy.popsize:
                strategy.tell(asked, scores)
    except KeyboardInterrupt:
        found.interrupted = True
    return found


def _strategy(start: np.ndarray, budget: int, seed: int) -> cma.CMAEvolutionStrategy:
    random = np.random.default_rng(seed)
    options = {
        "bounds": [0.0, 1.0],
        "seed": np.nan,  # It would seed numpy's global generator; it draws from ours instead.
        "randn": lambda *shape: random.standard_normal(shape),
        "maxfevals": budget,
        "verbose": -9,
    }
    return cma.CMAEvolutionStrategy(start, _FIRST_STEP, options)
