"""The storyboard: for every moment of a film all that figures and scene draw, before anything is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.planning.cells.exploration import Verdict
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.captions import counters, headline
from coop_drake.watching.components import Parts, parts_from_start
from coop_drake.watching.film import Film
from coop_drake.watching.moments import Moment, moments
from coop_drake.watching.shadows import Shadow, Shadows
from coop_drake.watching.way import Leg, legs_through

__all__ = ["Shot", "storyboard"]


@dataclass(frozen=True, eq=False)
class Shot:
    """One moment, ready to draw.

    Attributes:
        moment: What is known.
        headline: What just happened, or the verdict.
        counters: How far the search is.
        shadow: What is known about every position, for some angles.
        legs: The line through the channel.
        parts: What start and goal lie in, once they are proved to be apart; else None.
        looked_at: Point (theta, q...) of the exploration's axes through which subdivisions are cut,
            shape (1 + n,) [rad, m].
    """

    moment: Moment
    headline: str
    counters: str
    shadow: Shadow
    legs: tuple[Leg, ...]
    parts: Parts | None
    looked_at: FloatArray


def storyboard(film: Film, most: int) -> list[Shot]:
    """Choose at most ``most`` moments of a film and work out what to draw at each."""
    shots: list[Shot] = []
    shadows: dict[str, Shadows] = {}
    for moment in moments(film.events, most):
        own = shadows.setdefault(moment.question, Shadows())
        shots.append(_shot(film, moment, own, shots[-1] if shots else None))
    return shots


def _shot(film: Film, moment: Moment, shadows: Shadows, before: Shot | None) -> Shot:
    start, goal = film.start_of(moment.robots), film.goal_of(moment.robots)
    same = before is not None and before.moment.question == moment.question
    if before is not None and same and before.moment.channel is moment.channel:
        legs = before.legs
    else:
        legs = tuple(legs_through(moment.channel, start, goal))
    if moment.splits:
        looked_at = np.array([0.5 * (lower + upper) for lower, upper in moment.splits[-1][0].intervals])
    else:
        looked_at = before.looked_at if before is not None and same else start[2:]
    apart = moment.verdict == Verdict.INFEASIBLE.value
    leaves = list(moment.leaves.values())
    return Shot(
        moment=moment,
        headline=headline(film, moment),
        counters=counters(moment),
        shadow=shadows.of(leaves),
        legs=legs,
        parts=parts_from_start(leaves, start) if apart else None,
        looked_at=looked_at,
    )
