"""Strong branching: try every halving of a cell on a channel, keep the one that hurts the channel most."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.safeguards import shared
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cell_graph import Cell
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.halves import Halves
from coop_drake.planning.cells.slices import Slices, holds, share_facet


@dataclass(frozen=True)
class Trial:
    """What halving a cell along one axis would do.

    Attributes:
        axis: The axis.
        cuts: Whether no way is left through the halves from the channel's previous to its next cell.
        area: Area that the halves keep of the cell, both together [m^2].
    """

    axis: int
    cuts: bool
    area: float


@dataclass(frozen=True)
class _Part:
    half: int
    intervals: Intervals
    region: Region


class StrongBranching:
    """Tries halvings for one exploration.

    Args:
        problem: Start and goal, where channels begin and end.
        slices: The subdivision.
        maker: Cells of slices.
        halves: Over-cells of halves.
    """

    def __init__(self, problem: PlanningProblem, slices: Slices, maker: CellMaker, halves: Halves) -> None:
        self._slices, self._maker, self._halves = slices, maker, halves
        self._blames: Counter[int] = Counter()
        start, goal = problem.start, problem.goal_pose
        self._start = [float(angle) for angle in start[2:]], start[:2]
        self._goal = [float(goal[2]), *problem.goal_joints], goal[:2]

    def trial(self, channel: Sequence[Cell], place: int, axis: int) -> Trial:
        """Halve the cell at a place of a channel along an axis, for a trial."""
        cell = channel[place]
        parts = [
            _Part(number, half.intervals, region)
            for number, half in enumerate(self._halves.of(cell.slice, axis))
            for region in half.regions
            if region.meets(cell.region)
        ]
        first = [self._enters(part, channel, place - 1) for part in parts]
        last = [self._enters(part, channel, place + 1) for part in parts]
        area = sum(shared(part.region.section, cell.region.section, over=True).area() for part in parts)
        return Trial(axis, not _joined(parts, first, last), round(area, 9))

    def blamed(self, channel: Sequence[Cell], place: int) -> tuple[int, ...]:
        """Axes of a component that alone cuts the channel at a slice's middle; none if none does.

        The object goes first: it needs the fewest axes. Of several others the one that was blamed most often
        before is: a proof that is about few of the axes needs far fewer slices.
        """
        intervals = self._slices.all[channel[place].slice].intervals
        middle = [0.5 * (lower + upper) for lower, upper in intervals]
        cutting = []
        for component, axes in enumerate(self._maker.moving_axes):
            if axes and self._cuts(self._maker.places_for(component, middle), intervals, channel, place):
                if component == 0:
                    return axes
                cutting.append(component)
        if not cutting:
            return ()
        chosen = max(cutting, key=lambda component: (self._blames[component], -component))
        self._blames[chosen] += 1
        return self._maker.moving_axes[chosen]

    def _cuts(
        self, regions: Sequence[Region], intervals: Intervals, channel: Sequence[Cell], place: int
    ) -> bool:
        """Whether none of the regions joins the channel's previous to its next cell."""
        near = [_Part(0, intervals, region) for region in regions if region.meets(channel[place].region)]
        return not any(
            self._enters(part, channel, place - 1) and self._enters(part, channel, place + 1) for part in near
        )

    def _enters(self, part: _Part, channel: Sequence[Cell], place: int) -> bool:
        """Whether a part touches the channel's cell at a place, or the start or goal beyond its ends."""
        if 0 <= place < len(channel):
            other = channel[place]
            beside = share_facet(part.intervals, self._slices.all[other.slice].intervals)
            return beside and part.region.meets(other.region)
        angles, position = self._start if place < 0 else self._goal
        return holds(part.intervals, angles) and part.region.holds(position)


def _joined(parts: Sequence[_Part], first: Sequence[bool], last: Sequence[bool]) -> bool:
    """Whether a way leads from a first to a last part, through parts of both halves in turn."""
    reached = [number for number, entered in enumerate(first) if entered]
    seen = set(reached)
    while reached:
        here = reached.pop()
        if last[here]:
            return True
        for number, part in enumerate(parts):
            if number in seen or part.half == parts[here].half:
                continue
            if part.region.meets(parts[here].region):
                seen.add(number)
                reached.append(number)
    return False
