"""Ways with room to both sides: the best of some candidates, drawn away from the walls, then straightened."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.questions.margins import SMALLEST_MARGIN, marginal_workspace
from coop_drake.planning.sampling.elastic_band import drawn_tight, likely_time, room_along
from coop_drake.planning.sampling.sampler import Ladder, Sampler
from coop_drake.tree.pose import FloatArray

__all__ = ["best_of", "margins_along", "with_room"]

LEAST_CLEARANCE = 0.002
"""Clearance that candidates keep [m]."""

SAMPLED_CLEARANCE = 0.015
"""Clearance that other candidates are sampled with [m]."""

CANDIDATES, CHOICES, SAMPLES, SEED = 3, 3, 2_500, 1
"""So many other candidates are sampled, each along the quickest of so many paths of the object, with so many
samples for each stage."""

BRIEF = 1_200
"""Moves after which candidates are compared."""

WIDE_PRICE, WIDE_MOVES = 0.6, 2_000
"""Price at which a way is drawn away from the walls [m], and moves for it."""

KEPT = 0.75
"""Share of its clearance that a way keeps while it is straightened [-]."""

STRAIGHT = (0.1, 2_000), (0.05, 800)
"""Spacings [m] and moves with which it is straightened."""

NARROW, FINE, REPEATS = 0.01, (0.02, 16_000), 3
"""Below this clearance [m] a way is drawn from the walls again with samples so close [m], with so many moves,
and so often."""

MARGIN_SHARES = (0.8, 0.65, 0.5, 0.35)
"""Shares of a way's clearance that its boxes may keep as a margin, tried in this order [-]."""


def best_of(problem: PlanningProblem, ladder: Ladder, known: FloatArray, gap: float) -> FloatArray:
    """The best of a known path and of some more, by length and clearance: they may turn another way.

    The first that is not found ends it: more would fail, too.

    Args:
        problem: The question.
        ladder: Its stages.
        known: A free path, theta unwrapped, shape (m, 3 + n).
        gap: Distance that pairs of bodies keep [m].
    """
    sampler = Sampler(ladder, marginal_workspace(problem, SAMPLED_CLEARANCE), gap, SEED)
    sampled = (sampler.path(SAMPLES, CHOICES) for _ in range(CANDIDATES))
    paths = [known, *takewhile(len, sampled)]
    tight = [drawn_tight(problem, path, LEAST_CLEARANCE, 0.0, gap, moves=BRIEF) for path in paths]
    return min(tight, key=lambda path: likely_time(problem, path))


def with_room(problem: PlanningProblem, path: FloatArray, gap: float) -> FloatArray:
    """Draw a path away from the walls, and straighten it as far as it keeps most of that clearance.

    Args:
        problem: The question.
        path: A free path, theta unwrapped, shape (m, 3 + n).
        gap: Distance that pairs of bodies keep [m].
    """
    most = problem.settings.margin / min(MARGIN_SHARES)
    path = drawn_tight(problem, path, LEAST_CLEARANCE, 0.0, gap, moves=WIDE_MOVES, price=WIDE_PRICE)
    clearance = max(KEPT * room_along(problem, path, most), LEAST_CLEARANCE)
    for spacing, moves in STRAIGHT:
        path = drawn_tight(problem, path, clearance, clearance, gap, spacing, moves)
    return _through_narrows(problem, path, gap)


def _through_narrows(problem: PlanningProblem, path: FloatArray, gap: float) -> FloatArray:
    """The same way, if it is narrow in the middle of what there is: a millimetre there is a minute."""
    room = room_along(problem, path, NARROW)
    for _ in range(REPEATS if 0.0 < room < NARROW else 0):
        wider = drawn_tight(problem, path, 0.8 * room, 0.0, gap, *FINE, WIDE_PRICE)
        reached = room_along(problem, wider, NARROW)
        if reached <= room:
            break
        path, room = wider, reached
    return path


def margins_along(problem: PlanningProblem, path: FloatArray) -> Iterator[float]:
    """Margins to try for boxes along a path, those that are not worth an attempt left out [m].

    Args:
        problem: The question, whose settings hold the largest margin.
        path: A free path, theta unwrapped, shape (m, 3 + n).
    """
    largest = problem.settings.margin
    room = room_along(problem, path, largest / MARGIN_SHARES[0])
    for share in MARGIN_SHARES:
        margin = min(share * room, largest)
        if margin >= SMALLEST_MARGIN:
            yield margin
