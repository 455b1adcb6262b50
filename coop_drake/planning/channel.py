"""What a search returns: a channel (a sequence of free boxes), a path that boxes cover, or neither."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely
from shapely import Point

from coop_drake.answers.plan import MixedCell
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.errors import PlanError
from coop_drake.geometry.minkowski import to_polygon
from coop_drake.geometry.passage import pole
from coop_drake.geometry.polygons import BoundaryDistance, parts_of
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, FreeBox
from coop_drake.planning.questions import end_in, ending_at, nearby
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import nearest_turn, turns_to


@dataclass(frozen=True)
class Channel:
    """A sequence of free boxes; positions and intervals of consecutive boxes overlap with interior.

    Attributes:
        boxes: From the box that holds the start to the box that holds the goal.
        goal_angle: Theta where it ends, unwrapped along the boxes [rad].
        path: The path that the boxes were laid along, circular axes unwrapped like theirs, shape (m, 3 + n)
            [m, rad]; None if they were found without a path.
        ends: Where that path leaves each box, shape (boxes, 2) [m]; None without a path.
        end: The configuration in which it ends without a path, circles modulo a turn, shape (3 + n,)
            [m, rad]; None for the middle of the goal.
        margin: The margin rho that the samples of that path keep, measured [m].
    """

    boxes: tuple[FreeBox, ...]
    goal_angle: float
    path: FloatArray | None = None
    ends: FloatArray | None = None
    end: FloatArray | None = None
    margin: float = 0.0


def exits(channel: Channel) -> list[FloatArray]:
    """Where boxes may be left: the middle of the widest part of each two boxes' overlap.

    An overlap may have several parts, and boxes need not join all of them where it is a tenth of a millimetre
    wide. If a path leaves the boxes there, its own part counts.

    Returns:
        Positions, shape (2,) each [m].

    Raises:
        PlanError: If two boxes do not overlap; names them.
    """
    found = []
    for index, (one, other) in enumerate(pairwise(channel.boxes)):
        parts = [part for part in parts_of(one.polygon.intersection(other.polygon)) if part.area > 0.0]
        if not parts:
            raise PlanError(f"cells {index} and {index + 1}: their positions do not overlap")
        if channel.ends is not None:
            left = Point(channel.ends[index])
            parts = [part for part in parts if part.covers(left)] or parts
        found.append(max(map(pole, parts), key=lambda middle: middle[1])[0])
    return found


def middle_of(channel: Channel, start: FloatArray) -> FloatArray:
    """Configurations in the middle of each two boxes' overlap, after the start, shape (m, 3 + n) [m, rad].

    They are free; what is between them need not be.

    Raises:
        PlanError: If two boxes do not overlap.
    """
    rows = [start]
    for (one, other), place in zip(pairwise(channel.boxes), exits(channel), strict=True):
        angles = 0.5 * (np.maximum(one.lower, other.lower) + np.minimum(one.upper, other.upper))
        rows.append(np.concatenate((place, angles)))
    return np.array(rows)


@dataclass(frozen=True)
class CoveredPath:
    """A path from start to goal, and a channel of boxes along it that is made on request.

    Attributes:
        path: From start to goal, circular axes unwrapped, shape (m, 3 + n) [m, rad].
        margin: The margin rho that its samples keep, measured [m].
        channel: Makes the channel, proved free; raises a GeometryError if geometry fails.
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


# From free boxes to a channel: all free positions of every box.

MANY_COORDINATES = 150
"""On a floor with more corners only the part near a box is looked at, because Minkowski differences of the
whole floor would take most of the time."""


class Regions:
    """Computes the free positions of boxes along a path.

    Args:
        problem: The question.
        swept: Sweeps of its tree.
    """

    def __init__(self, problem: PlanningProblem, swept: SweptTree) -> None:
        self._swept, self._floor = swept, problem.workspace
        large = shapely.get_num_coordinates(problem.workspace) > MANY_COORDINATES
        self._whole = None if large else CellMaker(swept, problem.workspace)

    def around(self, box: FreeBox) -> FreeBox | None:
        """A box with the free positions that are connected to its own; None if geometry fails.

        On a large floor only the part near the box is looked at: the result is smaller, but as free.
        """
        maker, ends = self._whole, box.positions[[0, -1]]
        if maker is None:
            near = nearby(self._floor, box.positions, self._swept.tree.reach)
            maker = None if near.is_empty else CellMaker(self._swept, near)
        for region in () if maker is None else maker.under_cells(box.intervals):
            if region.depths(ends).min() > 0.0:
                return replace(box, polygon=to_polygon(region.section))
        return None


def unwrapped(
    intervals: Sequence[Intervals], start: Sequence[float], circular: Sequence[bool]
) -> list[Intervals]:
    """Shift boxes by whole turns along circular axes so that consecutive ones lie next to each other.

    Args:
        intervals: Intervals of (theta, q...) of every box.
        start: Values of (theta, q...) that the first one lies next to, length 1 + n [rad, m].
        circular: Which of these axes are circles.
    """
    result: list[Intervals] = []
    near = list(start)
    for box in intervals:
        centres = [0.5 * (lower + upper) for lower, upper in box]
        shifts = turns_to(centres, near, circular)
        result.append(
            tuple((a + shift, b + shift) for (a, b), shift in zip(box, shifts.tolist(), strict=True))
        )
        near = [centre + shift for centre, shift in zip(centres, shifts.tolist(), strict=True)]
    return result


def make_channel(problem: PlanningProblem, boxes: Sequence[FreeBox], path: FloatArray | None) -> Channel:
    """Make a channel of free boxes.

    Args:
        problem: The question.
        boxes: Free boxes, of which consecutive ones overlap.
        path: The path that they were laid along, shape (m, 3 + n); None if there is none.
    """
    start = problem.start[2:].tolist()
    turned = unwrapped([box.intervals for box in boxes], start, problem.tree.circular)
    free = tuple(
        replace(
            box,
            lower=np.array([lower for lower, _ in angles]),
            upper=np.array([upper for _, upper in angles]),
        )
        for box, angles in zip(boxes, turned, strict=True)
    )
    end = None if path is not None else end_in(problem, turned[-1], BoundaryDistance(free[-1].polygon))
    asked = problem if end is None else ending_at(problem, end)
    middle = 0.5 * (free[-1].lower[0] + free[-1].upper[0])
    goal = float(middle + nearest_turn(float(asked.goal_pose[2]) - middle))
    return Channel(free, goal, path, end=end)
