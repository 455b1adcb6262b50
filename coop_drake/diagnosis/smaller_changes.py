"""Smaller changes that are enough for a path near the one found: move the path, and prove it free again."""

from __future__ import annotations

import numpy as np

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.variants import Answer, BudgetedPlanner, Outcome
from coop_drake.planning.sampling.narrow_passages import (
    Eased,
    amount_needed,
    are_free,
    ease_less,
    with_larger_least_clearance,
)
from coop_drake.tree.pose import FloatArray

FRACTIONS = (0.1, 0.25, 0.5)
"""A proof is tried at these fractions of the way from the amount that a path needs to the amount that is
known to be enough [-]."""

ROUNDS = 4
"""Paths that are moved and proved one after another [-]."""

MOVES = 6
"""Times that a stretch of a path is moved away from the walls [-]."""

WINDOW = 40
"""Samples on either side of a colliding stretch that are moved with it [-]."""

NO_PROGRESS = 0.25
"""Less than this fraction of the resolution is no progress [-]."""


def least_change(
    eased: Eased, amount: float, outcome: Outcome, planner: BudgetedPlanner, resolution: float
) -> tuple[float, Outcome]:
    """Look for a smaller change that is enough for a path near the one found with an amount.

    ``resolution``: how closely the amount is looked for.

    Returns:
        The smallest amount with which such a path was proved free, and its outcome.
    """
    least = NO_PROGRESS * resolution
    for _ in range(ROUNDS):
        if outcome.path is None or amount <= resolution:
            break
        path, needed = ease_less(eased, outcome.path, amount, least)
        for fraction in FRACTIONS:
            less = needed + fraction * (amount - needed)
            if amount - less > least:
                proved = planner.prove(eased(less), path)
                if proved.answer is Answer.FOUND:
                    amount, outcome = less, proved
                    break
        else:
            break
    return amount, outcome


def clear_elsewhere(eased: Eased, path: FloatArray, enough: float) -> FloatArray:
    """Move a path off the walls wherever it need not leave the floor; the place where it leaves most stays.

    The path, shape (m, 3 + n), is free with the walls moved back by the amount ``enough`` [m].
    """
    floor = eased(0.0)
    _, worst = amount_needed(eased, path, enough)
    for rows in _blocked_runs(floor, path):
        if rows[0] <= worst <= rows[-1]:
            continue
        first, last = max(0, rows[0] - WINDOW), min(len(path) - 1, rows[-1] + WINDOW)
        first, last = (max(first, worst + 1), last) if worst < rows[0] else (first, min(last, worst - 1))
        if last - first < 2:
            continue
        here, ends = slice(first, last + 1), last == len(path) - 1
        for number in range(MOVES):
            needed, _ = amount_needed(eased, path[here], enough)
            part = with_larger_least_clearance(eased(needed), path[here], number, free_end=ends)
            if amount_needed(eased, part, enough)[0] <= needed:
                path = np.concatenate((path[:first], part, path[last + 1 :]))
            if are_free(floor, path[here]).all():
                break
    return path


def _blocked_runs(problem: PlanningProblem, path: FloatArray) -> list[tuple[int, int]]:
    """First and last rows of the runs of samples that are not free."""
    free = are_free(problem, path)
    edges = np.flatnonzero(np.diff(np.concatenate(([1], free.astype(np.int8), [1]))))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
