"""Paths with clearance: the best of some candidates, moved away from the walls and then straightened."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.margins import SMALLEST_MARGIN, marginal_workspace
from coop_drake.planning.sampling.elastic_band import estimated_duration, path_clearance, smoothed
from coop_drake.planning.sampling.sampler import Sampler
from coop_drake.planning.sampling.subsystems import SubsystemHierarchy
from coop_drake.tree.pose import FloatArray

LEAST_CLEARANCE = 0.002
"""Clearance that candidates keep [m], as paths of the first attempts do."""

SAMPLED_CLEARANCE = 0.015
"""Clearance that other candidates are sampled with [m]: wider ones are faster."""

CANDIDATES, CHOICES, SAMPLES, SEED = 2, 3, 2_500, 1
"""Number of other candidates, of paths of the object that each is chosen from, and of samples for every
subsystem; the seed of the samples."""

COMPARED_MOVES = 1_200
"""Moves of smoothing after which candidates are compared: before it, random detours decide."""

WIDE_PRICE, WIDE_MOVES = 0.6, 2_000
"""Price of narrowness with which a path is moved away from the walls [m], five times the usual one, and the
number of moves."""

KEPT_FRACTION = 0.75
"""Fraction of its clearance that a path keeps while it is straightened [-]."""

STRAIGHTENINGS = (0.1, 2_000), (0.05, 800)
"""Spacing of samples [m] and number of moves with which it is straightened."""

NARROW, NARROW_SPACING, NARROW_MOVES, NARROW_REPEATS = 0.01, 0.02, 16_000, 3
"""A path with less clearance than this [m] is moved again with this spacing of samples [m], so many moves and
so many repetitions: in such a passage every millimetre saves a minute."""

NARROW_KEPT_FRACTION = 0.8
"""Fraction of its clearance that a path keeps meanwhile [-]."""

MARGIN_FRACTIONS = (0.8, 0.65, 0.5, 0.35)
"""Fractions of a path's clearance that its boxes may keep as a margin, tried in this order [-]."""


def best_candidate(
    problem: PlanningProblem, hierarchy: SubsystemHierarchy, known: FloatArray, gap: float
) -> FloatArray:
    """The path with the shortest estimated duration among a known one and sampled ones.

    Sampled paths may turn the team in other directions. Sampling stops at the first failure.

    Args:
        problem: The question.
        hierarchy: Its subsystems.
        known: A free path, theta unwrapped, shape (m, 3 + n) [m, rad].
        gap: Smallest distance between bodies of the team [m].
    """
    sampler = Sampler(hierarchy, marginal_workspace(problem, SAMPLED_CLEARANCE), gap, SEED)
    sampled = (sampler.path(SAMPLES, CHOICES) for _ in range(CANDIDATES))
    paths = [known, *takewhile(len, sampled)]
    tight = [smoothed(problem, path, LEAST_CLEARANCE, 0.0, gap, moves=COMPARED_MOVES) for path in paths]
    return min(tight, key=lambda path: estimated_duration(problem, path))


def moved_from_obstacles(problem: PlanningProblem, path: FloatArray, gap: float) -> FloatArray:
    """Move a path away from the walls, and straighten it such that it keeps most of that clearance.

    Args:
        problem: The question.
        path: A free path, theta unwrapped, shape (m, 3 + n) [m, rad].
        gap: Smallest distance between bodies of the team [m].
    """
    most = problem.settings.margin / min(MARGIN_FRACTIONS)
    path = smoothed(problem, path, LEAST_CLEARANCE, 0.0, gap, moves=WIDE_MOVES, price=WIDE_PRICE)
    clearance = max(KEPT_FRACTION * path_clearance(problem, path, most), LEAST_CLEARANCE)
    for spacing, moves in STRAIGHTENINGS:
        path = smoothed(problem, path, clearance, clearance, gap, spacing, moves)
    return centred_in_narrow_passages(problem, path, gap)


def centred_in_narrow_passages(problem: PlanningProblem, path: FloatArray, gap: float) -> FloatArray:
    """Move a path with less clearance than ``NARROW`` to the middle of its passages; others stay the same.

    Args:
        problem: The question.
        path: A free path, theta unwrapped, shape (m, 3 + n) [m, rad].
        gap: Smallest distance between bodies of the team [m].
    """
    clearance = path_clearance(problem, path, NARROW)
    for _ in range(NARROW_REPEATS if 0.0 < clearance < NARROW else 0):
        kept = NARROW_KEPT_FRACTION * clearance
        wider = smoothed(problem, path, kept, 0.0, gap, NARROW_SPACING, NARROW_MOVES, WIDE_PRICE)
        reached = path_clearance(problem, wider, NARROW)
        if reached <= clearance:
            break
        path, clearance = wider, reached
    return path


def margins_to_try(problem: PlanningProblem, path: FloatArray) -> Iterator[float]:
    """Margins to try for boxes along a path, largest first; those too small to be worth it are left out [m].

    Args:
        problem: The question, whose settings hold the largest margin.
        path: A free path, theta unwrapped, shape (m, 3 + n) [m, rad].
    """
    largest = problem.settings.margin
    clearance = path_clearance(problem, path, largest / MARGIN_FRACTIONS[0])
    for fraction in MARGIN_FRACTIONS:
        margin = min(fraction * clearance, largest)
        if margin >= SMALLEST_MARGIN:
            yield margin
