"""A way for an easier question, drawn tight while the question grows as hard as it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.sampling.collision_kernels import is_free
from coop_drake.planning.sampling.elastic_band_kernels import improve
from coop_drake.planning.sampling.obstacle_grid import walls_for
from coop_drake.planning.sampling.sampler import densified
from coop_drake.planning.sampling.team_arrays import team_arrays
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

_GAP = 0.002
_PRICES = (0.04, 5e-4, 0.1)
"""A sample with clearance c costs [0] / ([1] + min(c, [2])): steep, so that the tightest place counts."""

_SPACING = 0.05
_MOVES = 2_000
_WINDOW = 40
_HALVINGS = 10
_DRAWINGS = 6
_ROUNDS = 3
_ROOM = 0.001
_MITRE = 5.0

Varied = Callable[[float], PlanningProblem]
"""The question made easier by an amount; what is free for one amount is free for every larger one."""


def drawn_closer(
    varied: Varied, way: FloatArray, amount: float, enough: float = 0.0
) -> tuple[FloatArray, float]:
    """Draw a way away from what it touches while the question gets harder.

    The first drawing straightens all of the way, the others work in a window where it is tightest.

    Args:
        varied: The question made easier by an amount.
        way: A way that is free with ``amount``, theta unwrapped, shape (m, 3 + n).
        amount: The amount.
        enough: Amount at which it may end.

    Returns:
        The way, and the amount with which all its samples are free: a measure, and no proof.
    """
    way = densified(way, configuration_scale(varied(amount).tree), _SPACING)
    needed, worst = amount_needed(varied, way, amount)
    for number in range(_DRAWINGS):
        if needed <= enough:
            break
        here = slice(max(0, worst - _WINDOW), worst + _WINDOW + 1) if number else slice(None)
        last = here.stop is None or here.stop >= len(way)
        part = drawn(varied(needed), way[here], number, free_end=last)
        tight = np.concatenate((way[: here.start or 0], part, way[len(way) if last else here.stop :]))
        less, at = amount_needed(varied, tight, needed)
        if less <= needed:
            way, needed, worst = tight, less, at
    return way, needed


def drawn(problem: PlanningProblem, way: FloatArray, seed: int, *, free_end: bool) -> FloatArray:
    """Draw a free way so that it has more room where it has least.

    Args:
        problem: The question.
        way: Samples, close together, shape (m, 3 + n).
        seed: Other random moves for every seed.
        free_end: Whether the way ends at the goal, where free joints may move.
    """
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


def amount_needed(varied: Varied, way: FloatArray, most: float) -> tuple[float, int]:
    """Least amount, up to ``most``, with which all samples are free, and the sample that needs most."""
    lower, upper, worst = 0.0, most, 0
    for _ in range(_HALVINGS):
        middle = 0.5 * (lower + upper)
        blocked = np.flatnonzero(~are_free(varied(middle), way))
        if len(blocked):
            lower, worst = middle, int(blocked[0])
        else:
            upper = middle
    return upper, worst


def are_free(problem: PlanningProblem, way: FloatArray) -> NDArray[np.bool_]:
    """Whether each sample keeps within limits and walls, and bodies apart; exact, shape (m,)."""
    tree = problem.tree
    team = team_arrays(tree)
    walls = walls_for(problem.workspace, team)
    within = np.all((way[:, 3:] >= tree.joint_lower) & (way[:, 3:] <= tree.joint_upper), axis=1)
    free: NDArray[np.bool_] = within & np.array([is_free(team, walls, z, 0.0) for z in way])
    return free


def widened(workspace: Polygon, amount: float) -> MultiPolygon:
    """Workspace with all walls moved back, thin ones broken through: for samples, not for answers."""
    grown = workspace.buffer(amount, join_style="mitre", mitre_limit=_MITRE)
    return MultiPolygon([part for part in getattr(grown, "geoms", [grown]) if isinstance(part, Polygon)])


def fitted(problem: PlanningProblem, path: FloatArray, growth: float) -> FloatArray | None:
    """Draw a path for a larger floor until all its samples are free on the floor as it is.

    Args:
        problem: The question.
        path: A path on the floor widened by ``growth``, theta unwrapped, shape (m, 3 + n).
        growth: How far walls were moved back for it [m].

    Returns:
        The path, None if it does not get there. Samples prove nothing: boxes have to cover it.
    """

    def varied(amount: float) -> PlanningProblem:
        # Boxes need some room: the walls end up nearer than they are.
        return replace(problem, workspace=problem.workspace.buffer(amount - _ROOM, join_style="mitre"))

    needed = growth + _ROOM
    for _ in range(_ROUNDS):
        before = needed
        path, needed = drawn_closer(varied, path, needed, enough=0.1 * _ROOM)
        if needed <= 0.1 * _ROOM or needed > 0.8 * before:
            break
    return path if needed <= _ROOM else None
