"""A smaller change that is enough for a way near the one found: draw it tight, and prove it there again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from coop_drake.diagnosis.trials import Answer, Trial, Trials
from coop_drake.geometry.pose import FloatArray
from coop_drake.planning import PlanningProblem
from coop_drake.planning.band_kernels import improve
from coop_drake.planning.collision_kernels import is_free
from coop_drake.planning.refine import configuration_scale
from coop_drake.planning.sampler import densified
from coop_drake.planning.team_arrays import team_arrays
from coop_drake.planning.walls import walls_for

__all__ = ["Varied", "relieved", "squeezed"]

_GAP = 0.002
_PRICES = (0.04, 5e-4, 0.1)  # A sample with clearance c costs [0] / ([1] + min(c, [2])).
_SPACING = 0.05
_MOVES = 2_000
_WINDOW = 40
_HALVINGS = 10
_DRAWINGS = 6
_SLACKS = (0.1, 0.25, 0.5)
_ROUNDS = 4

Varied = Callable[[float], PlanningProblem]


def _drawn_way(varied: Varied, way: FloatArray, amount: float, resolution: float) -> tuple[FloatArray, float]:
    """Draw a way away from what it touches while the change is taken back.

    Args:
        varied: The question with an amount of the change.
        way: A way that is free with ``amount``, shape (m, 3 + n).
        amount: The amount of the change.
        resolution: Less than this is no progress.

    Returns:
        The way drawn tight, and the amount with which all its samples are free: a measure, and no proof.
    """
    way = densified(way, configuration_scale(varied(amount).tree), _SPACING)
    needed, worst = _needed(varied, way, amount)
    for number in range(_DRAWINGS):
        # The first drawing straightens all of the way, the others work where it is tightest.
        here = slice(max(0, worst - _WINDOW), worst + _WINDOW + 1) if number else slice(None)
        last = here.stop is None or here.stop >= len(way)
        part = _drawn(varied(needed), way[here], number, free_end=last)
        tight = np.concatenate((way[: here.start or 0], part, way[len(way) if last else here.stop :]))
        less, at = _needed(varied, tight, needed)
        if less <= needed:
            way, needed, worst = tight, less, at
        if needed < 0.25 * resolution:
            break
    return way, needed


def relieved(varied: Varied, way: FloatArray, enough: float) -> FloatArray:
    """Draw a way out of the walls wherever it need not stick out of the floor; its worst place stays.

    Args:
        varied: The question with the walls moved back by an amount [m].
        way: A way that is free with ``enough``, shape (m, 3 + n).
        enough: An amount [m].
    """
    floor = varied(0.0)
    _, worst = _needed(varied, way, enough)
    for rows in _blocked_runs(floor, way):
        if rows[0] <= worst <= rows[-1]:
            continue
        first, last = max(0, rows[0] - _WINDOW), min(len(way) - 1, rows[-1] + _WINDOW)
        first, last = (max(first, worst + 1), last) if worst < rows[0] else (first, min(last, worst - 1))
        if last - first < 2:
            continue
        here = slice(first, last + 1)
        for number in range(_DRAWINGS):
            needed, _ = _needed(varied, way[here], enough)
            part = _drawn(varied(needed), way[here], number, free_end=last == len(way) - 1)
            if _needed(varied, part, enough)[0] <= needed:
                way = np.concatenate((way[:first], part, way[last + 1 :]))
            if _first_blocked(floor, way[here]) is None:
                break
    return way


def _blocked_runs(problem: PlanningProblem, way: FloatArray) -> list[tuple[int, int]]:
    """First and last rows of the runs of samples that are not free."""
    free = _are_free(problem, way)
    edges = np.flatnonzero(np.diff(np.concatenate(([1], free.astype(np.int8), [1]))))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _drawn(problem: PlanningProblem, way: FloatArray, seed: int, *, free_end: bool) -> FloatArray:
    """The way with more room where it has least; other random moves for every seed."""
    tree = problem.tree
    team, scale = team_arrays(tree), configuration_scale(tree)
    unbounded = np.full(3, np.inf)
    better: FloatArray = improve(
        team,
        walls_for(problem.workspace, team),
        np.array(_PRICES),
        way,
        np.concatenate((-unbounded, tree.joint_lower)),
        np.concatenate((unbounded, tree.joint_upper)),
        scale,
        scale,
        _GAP,
        free_end and all(value is None for value in problem.goal_joints),
        np.random.default_rng(seed).random((_MOVES, 5)),
    )
    return better


def squeezed(
    varied: Varied, amount: float, trial: Trial, trials: Trials, resolution: float
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
        way, needed = _drawn_way(varied, trial.way, amount, resolution)
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


def _needed(varied: Varied, way: FloatArray, enough: float) -> tuple[float, int]:
    """Least amount, up to ``enough``, with which all samples are free, and the sample that needs most."""
    lower, upper, worst = 0.0, enough, 0
    for _ in range(_HALVINGS):
        middle = 0.5 * (lower + upper)
        blocked = _first_blocked(varied(middle), way)
        if blocked is None:
            upper = middle
        else:
            lower, worst = middle, blocked
    return upper, worst


def _first_blocked(problem: PlanningProblem, way: FloatArray) -> int | None:
    """First sample of a way beyond a limit or in contact, None if all are free."""
    blocked = np.flatnonzero(~_are_free(problem, way))
    return int(blocked[0]) if len(blocked) else None


def _are_free(problem: PlanningProblem, way: FloatArray) -> NDArray[np.bool_]:
    """Whether each sample keeps within limits and walls, and bodies apart, shape (m,)."""
    tree = problem.tree
    team = team_arrays(tree)
    walls = walls_for(problem.workspace, team)
    within = np.all((way[:, 3:] >= tree.joint_lower) & (way[:, 3:] <= tree.joint_upper), axis=1)
    free: NDArray[np.bool_] = within & np.array([is_free(team, walls, z, 0.0) for z in way])
    return free
