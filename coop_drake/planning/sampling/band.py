"""Paths with clearance: the best of some candidates, moved away from the walls and then straightened."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.margins import SMALLEST_MARGIN, marginal_workspace
from coop_drake.planning.sampling.elastic_band import estimated_duration, path_clearance, smoothed
from coop_drake.planning.sampling.sampler import FEW_JOINTS, Sampler
from coop_drake.planning.sampling.subsystems import SubsystemHierarchy
from coop_drake.tree.pose import FloatArray

LEAST_CLEARANCE = 0.002
"""Clearance that candidates keep [m], as paths of the first attempts do."""

SAMPLED_CLEARANCE = 0.015
"""Clearance that other candidates are sampled with [m]: wider ones are faster."""

CANDIDATES, CHOICES, SAMPLES, SEED = 2, 3, 2_500, 1
"""Number of other candidates, of paths of the object that each is chosen from, and of samples for every
subsystem; the seed of the samples."""

OTHER_CANDIDATES, OTHER_SAMPLES = 3, 4_000
"""The same for further paths, which are sampled for the whole team at once."""

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
    problem: PlanningProblem, hierarchy: SubsystemHierarchy, known: FloatArray, gap: float, share: float = 1.0
) -> FloatArray:
    """The path with the shortest estimated duration among a known one and sampled ones.

    Sampled paths may turn the team in other directions. Sampling robot after robot stops at the first
    failure; a large team is then sampled as a whole.

    Args:
        problem: The question.
        hierarchy: Its subsystems.
        known: A free path, circular axes unwrapped, shape (m, 3 + n) [m, rad].
        gap: Smallest distance between bodies of the team [m].
        share: Share of ``CANDIDATES`` that is sampled [-].
    """
    sampler = Sampler(hierarchy, marginal_workspace(problem, SAMPLED_CLEARANCE), gap, SEED)
    most = round(share * CANDIDATES)
    sampled = [*takewhile(len, (sampler.path(SAMPLES, CHOICES) for _ in range(most)))]
    if len(sampled) < most and len(problem.goal_joints) > FEW_JOINTS:
        sampled += filter(len, (sampler.direct_path(OTHER_SAMPLES) for _ in range(most - len(sampled))))
    return _quickest(problem, [known, *sampled], gap)


def another_candidate(
    problem: PlanningProblem, hierarchy: SubsystemHierarchy, gap: float, number: int, share: float
) -> FloatArray | None:
    """The path with the shortest estimated duration among sampled ones, None if none is found.

    Args:
        problem: The question.
        hierarchy: Its subsystems.
        gap: Smallest distance between bodies of the team [m].
        number: Other samples are drawn for every number (1, 2, ...).
        share: Share of ``OTHER_CANDIDATES`` that is sampled [-], at least one.
    """
    sampler = Sampler(hierarchy, marginal_workspace(problem, SAMPLED_CLEARANCE), gap, SEED + number)
    sampled = (sampler.direct_path(OTHER_SAMPLES) for _ in range(max(1, round(share * OTHER_CANDIDATES))))
    paths = [path for path in sampled if len(path)]
    return _quickest(problem, paths, gap) if paths else None


def _quickest(problem: PlanningProblem, paths: list[FloatArray], gap: float) -> FloatArray:
    """The path with the shortest estimated duration after a short smoothing."""
    tight = [smoothed(problem, path, LEAST_CLEARANCE, 0.0, gap, moves=COMPARED_MOVES) for path in paths]
    return min(tight, key=lambda path: estimated_duration(problem, path))


def moved_from_obstacles(
    problem: PlanningProblem, path: FloatArray, gap: float, share: float = 1.0
) -> FloatArray:
    """Move a path away from the walls, and straighten it such that it keeps most of that clearance.

    Args:
        problem: The question.
        path: A free path, circular axes unwrapped, shape (m, 3 + n) [m, rad].
        gap: Smallest distance between bodies of the team [m].
        share: Share of the usual number of moves that is tried [-].
    """
    most = problem.settings.margin / min(MARGIN_FRACTIONS)
    path = smoothed(
        problem, path, LEAST_CLEARANCE, 0.0, gap, moves=round(share * WIDE_MOVES), price=WIDE_PRICE
    )
    clearance = max(KEPT_FRACTION * path_clearance(problem, path, most), LEAST_CLEARANCE)
    for spacing, moves in STRAIGHTENINGS:
        path = smoothed(problem, path, clearance, clearance, gap, spacing, round(share * moves))
    return centred_in_narrow_passages(problem, path, gap)


def centred_in_narrow_passages(problem: PlanningProblem, path: FloatArray, gap: float) -> FloatArray:
    """Move a path with less clearance than ``NARROW`` to the middle of its passages; others stay the same.

    Args:
        problem: The question.
        path: A free path, circular axes unwrapped, shape (m, 3 + n) [m, rad].
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
        path: A free path, circular axes unwrapped, shape (m, 3 + n) [m, rad].
    """
    largest = problem.settings.margin
    clearance = path_clearance(problem, path, largest / MARGIN_FRACTIONS[0])
    for fraction in MARGIN_FRACTIONS:
        margin = min(fraction * clearance, largest)
        if margin >= SMALLEST_MARGIN:
            yield margin
