"""A smaller change that is enough for a way near the one found: draw it tight, and prove it there again."""

from __future__ import annotations

import numpy as np

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.trials import Answer, Trial, Trials
from coop_drake.planning.sampling.narrow_passages import (
    Eased,
    amount_needed,
    are_free,
    ease_less,
    with_larger_least_clearance,
)
from coop_drake.tree.pose import FloatArray

__all__ = ["relieved", "squeezed"]

_SLACKS = (0.1, 0.25, 0.5)
_ROUNDS = 4
_DRAWINGS = 6
_WINDOW = 40


def squeezed(
    varied: Eased, amount: float, trial: Trial, trials: Trials, resolution: float
) -> tuple[float, Trial]:
    """Look for a smaller change that is enough for a way near the one found.

    Args:
        varied: The question with an amount of the change.
        amount: Amount with which a channel was found.
        trial: The trial that found it.
        trials: Keeps account of the work.
        resolution: Less than this is no progress.

    Returns:
        The smallest amount with which such a way was proved free, and the trial for it.
    """
    for _ in range(_ROUNDS):
        if trial.way is None or amount <= resolution:
            break
        way, needed = ease_less(varied, trial.way, amount, 0.25 * resolution)
        better = None
        for share in _SLACKS:
            less = needed + share * (amount - needed)
            if better is None and amount - less > 0.25 * resolution:
                laid = trials.lay(varied(less), way)
                better = (less, laid) if laid.answer is Answer.FOUND else None
        if better is None:
            break
        amount, trial = better
    return amount, trial


def relieved(varied: Eased, way: FloatArray, enough: float) -> FloatArray:
    """Draw a way out of the walls wherever it need not stick out of the floor; its worst place stays.

    Args:
        varied: The question with the walls moved back by an amount [m].
        way: A way that is free with ``enough``, shape (m, 3 + n).
        enough: An amount [m].
    """
    floor = varied(0.0)
    _, worst = amount_needed(varied, way, enough)
    for rows in _blocked_runs(floor, way):
        if rows[0] <= worst <= rows[-1]:
            continue
        first, last = max(0, rows[0] - _WINDOW), min(len(way) - 1, rows[-1] + _WINDOW)
        first, last = (max(first, worst + 1), last) if worst < rows[0] else (first, min(last, worst - 1))
        if last - first < 2:
            continue
        here = slice(first, last + 1)
        for number in range(_DRAWINGS):
            needed, _ = amount_needed(varied, way[here], enough)
            part = with_larger_least_clearance(
                varied(needed), way[here], number, free_end=last == len(way) - 1
            )
            if amount_needed(varied, part, enough)[0] <= needed:
                way = np.concatenate((way[:first], part, way[last + 1 :]))
            if are_free(floor, way[here]).all():
                break
    return way


def _blocked_runs(problem: PlanningProblem, way: FloatArray) -> list[tuple[int, int]]:
    """First and last rows of the runs of samples that are not free."""
    free = are_free(problem, way)
    edges = np.flatnonzero(np.diff(np.concatenate(([1], free.astype(np.int8), [1]))))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
