"""What a search returns: a channel (a sequence of free boxes), a path that boxes cover, or neither."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from shapely import Polygon

from coop_drake.answers.mixed_cell import MixedCell
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.geometry.parts import parts_of
from coop_drake.geometry.passage import pole
from coop_drake.planning.questions.endings import ending_at
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class FreeBox:
    """A set of configurations proved free: every position in ``polygon`` with every angle in the intervals.

    Attributes:
        polygon: Positions p_WL, one connected component of the under-approximation at margin zero [m].
        core: The positions that keep the plan's margin, one connected component; a subset of ``polygon`` [m].
        lower: Lower ends of (theta, q...), expanded by the overlap, circular axes unwrapped, shape
            (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
    """

    polygon: Polygon
    core: Polygon
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True)
class Channel:
    """A sequence of free boxes; the cores and the intervals of consecutive boxes overlap with interior.

    Attributes:
        boxes: From the box that holds the start to the box that holds the goal.
        margin: The margin rho that the cores keep [m].
        goal_angle: Theta where it ends, unwrapped along the boxes [rad].
        path: The path that the boxes were laid along, circular axes unwrapped like theirs, shape (m, 3 + n)
            [m, rad]; None if they were found without a path.
        ends: Where that path leaves each box, shape (boxes, 2) [m]; None without a path.
        end: The configuration in which it ends without a path, circles modulo a turn, shape (3 + n,)
            [m, rad]; None for the middle of the goal.
    """

    boxes: tuple[FreeBox, ...]
    margin: float
    goal_angle: float
    path: FloatArray | None = None
    ends: FloatArray | None = None
    end: FloatArray | None = None


def middle_of(channel: Channel, start: FloatArray) -> FloatArray:
    """Configurations in the middle of each two boxes' overlap, after the start, shape (m, 3 + n) [m, rad].

    They are free; what is between them need not be.

    Raises:
        GeometryError: If two boxes have no position in common.
    """
    rows = [start]
    for one, other in pairwise(channel.boxes):
        parts = parts_of(one.core.intersection(other.core))
        centre, _ = pole(max(parts, key=lambda part: part.area, default=Polygon()))
        angles = 0.5 * (np.maximum(one.lower, other.lower) + np.minimum(one.upper, other.upper))
        rows.append(np.concatenate((centre, angles)))
    return np.array(rows)


@dataclass(frozen=True)
class CoveredPath:
    """A path that is covered with boxes proved free; the boxes' polygons are made on request.

    Attributes:
        path: From start to goal, circular axes unwrapped, shape (m, 3 + n) [m, rad].
        margin: The margin rho that the path keeps in every box [m].
        channel: Makes the channel of these boxes; raises a GeometryError if geometry fails.
        another: Finds another path by other samples, for a number (1, 2, ...) that these follow from and the
            share of the usual work that it may take [-]; None if it finds none.
    """

    path: FloatArray
    margin: float
    channel: Callable[[], Channel]
    another: Callable[[int, float], CoveredPath | None] = lambda number, share: None


def ended(problem: PlanningProblem, found: Channel | CoveredPath) -> PlanningProblem:
    """The question of ending where a channel or a path ends; the same one if it is the middle of the goal."""
    end = found.end if isinstance(found, Channel) else None
    if found.path is not None:
        end = found.path[-1]
    return problem if end is None else ending_at(problem, end)


@dataclass(frozen=True)
class NoChannel:
    """No channel was found.

    Attributes:
        proved: True if none exists; False if the budget was spent or the resolution was reached before.
        reason: Why, in a sentence.
        proof: The proof in a form that can be checked again, if there is one.
        mixed: If nothing was proved, the cells that the last exploration left undecided, the widest first.
    """

    proved: bool
    reason: str
    proof: InfeasibilityProof | None = None
    mixed: tuple[MixedCell, ...] = ()
