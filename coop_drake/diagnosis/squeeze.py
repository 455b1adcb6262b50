"""Less growth for the same way: draw it tight, see what it still needs, and prove it there again."""

from __future__ import annotations

from collections.abc import Callable

from coop_drake.diagnosis.contacts import deepest
from coop_drake.diagnosis.trials import Answer, Trial, Trials
from coop_drake.geometry.pose import FloatArray
from coop_drake.planning import PlanningProblem
from coop_drake.planning.band import drawn_tight

__all__ = ["drawn_way", "squeezed"]

_GAP = 0.002
_HAIR = 5e-4
_DRAWINGS = 4
_SLACKS = (0.003, 0.008, 0.016)
_PROGRESS = 0.001
_ROUNDS = 3

Varied = Callable[[float], PlanningProblem]


def drawn_way(varied: Varied, way: FloatArray) -> tuple[FloatArray, float]:
    """Draw a way away from the walls while they close in on it.

    Args:
        varied: The question with the walls moved back by an amount [m].
        way: A way that is free for some amount, shape (m, 3 + n).

    Returns:
        The way drawn tight, and how far it sticks out of the floor as it is at most [m].
    """
    floor = varied(0.0)
    needed = _needed(floor, way)
    for _ in range(_DRAWINGS):
        tight = drawn_tight(varied(needed + _HAIR), way, 0.0, 0.0, _GAP)
        before, now = needed, _needed(floor, tight)
        if now >= before:
            break
        way, needed = tight, now
        if before - now < _HAIR:
            break
    return way, needed


def squeezed(varied: Varied, amount: float, trial: Trial, trials: Trials) -> tuple[float, Trial]:
    """Look for a smaller growth that is enough for a way near the one found.

    Args:
        varied: The question with the walls moved back by an amount [m].
        amount: Growth with which a channel was found [m].
        trial: The trial that found it.
        trials: Keeps account of the work.

    Returns:
        The smallest growth with which such a channel was proved, and the trial for it.
    """
    for _ in range(_ROUNDS):
        if trial.way is None:
            break
        way, needed = drawn_way(varied, trial.way)
        better = None
        for less in (needed + slack for slack in _SLACKS):
            if less < amount - _PROGRESS and better is None:
                laid = trials.lay(varied(less), way, "drawing the way tight")
                better = (less, laid) if laid.answer is Answer.FOUND else None
        if better is None:
            break
        amount, trial = better
    return amount, trial


def _needed(floor: PlanningProblem, way: FloatArray) -> float:
    return max(deepest(floor.workspace, floor.tree, z) for z in way)
