"""Strong branching: halve a cell of a path on trial, and see what remains of the path."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.geometry.safeguards import shared
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cell_graph import GraphCell
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.slices import Slices, halves, holds, meets, share_facet


@dataclass(frozen=True)
class TrialSplit:
    """What halving a cell along one axis would do.

    Attributes:
        axis: The axis.
        disconnects: Whether the halves no longer join the path's previous cell to its next cell.
        area: Area of the cell that the over-cells of both halves keep, added up [m^2].
    """

    axis: int
    disconnects: bool
    area: float


@dataclass(frozen=True)
class _Part:
    half: int
    intervals: Intervals
    region: Region


class StrongBranching:
    """Halves cells on trial for one exploration.

    Args:
        problem: Start and goal, where paths begin and end.
        slices: The subdivision.
        maker: Makes the cells of slices.
    """

    def __init__(self, problem: PlanningProblem, slices: Slices, maker: CellMaker) -> None:
        self._slices, self._maker = slices, maker
        self._times_blocking: Counter[int] = Counter()
        self._start = [float(angle) for angle in problem.start[2:]], problem.start[:2]
        self._goal = goal_box(problem), problem.goal_pose[:2], problem.position_tolerance

    def trial(self, path: Sequence[GraphCell], place: int, axis: int) -> TrialSplit:
        """Halve the cell at a place of a path along an axis, on trial."""
        cell = path[place]
        parts = [
            _Part(number, half, region)
            for number, half in enumerate(halves(self._slices.all[cell.slice].intervals, axis))
            for region in self._maker.over_cells(half)
            if region.meets(cell.region)
        ]
        first = [self._enters(part, path, place - 1) for part in parts]
        last = [self._enters(part, path, place + 1) for part in parts]
        area = sum(shared(part.region.section, cell.region.section, over=True).area() for part in parts)
        return TrialSplit(axis, not _joined(parts, first, last), round(area, 9))

    def blocking_axes(self, path: Sequence[GraphCell], place: int) -> tuple[int, ...]:
        """Axes that move a component which, alone, blocks the path at a slice's middle; empty if none does.

        The object is preferred, because only theta moves it. Among several other components the one that has
        blocked most often before is chosen: a proof along few axes needs far fewer slices.
        """
        intervals = self._slices.all[path[place].slice].intervals
        middle = [0.5 * (lower + upper) for lower, upper in intervals]
        blocking = []
        for component, axes in enumerate(self._maker.moving_axes):
            if axes and self._blocks(self._maker.places_for(component, middle), intervals, path, place):
                if component == 0:
                    return axes
                blocking.append(component)
        if not blocking:
            return ()
        chosen = max(blocking, key=lambda component: (self._times_blocking[component], -component))
        self._times_blocking[chosen] += 1
        return self._maker.moving_axes[chosen]

    def _blocks(
        self, regions: Sequence[Region], intervals: Intervals, path: Sequence[GraphCell], place: int
    ) -> bool:
        """Whether none of the regions joins the path's previous cell to its next cell."""
        near = [_Part(0, intervals, region) for region in regions if region.meets(path[place].region)]
        return not any(
            self._enters(part, path, place - 1) and self._enters(part, path, place + 1) for part in near
        )

    def _enters(self, part: _Part, path: Sequence[GraphCell], place: int) -> bool:
        """Whether a part touches the path's cell at a place, or holds the start or goal beyond its ends."""
        if 0 <= place < len(path):
            other = path[place]
            intervals = self._slices.all[other.slice].intervals
            beside = share_facet(part.intervals, intervals, self._slices.circular)
            return beside and part.region.meets(other.region)
        circular = self._slices.circular
        if place < 0:
            angles, position = self._start
            return holds(part.intervals, angles, circular) and part.region.holds(position)
        box, position, room = self._goal
        return meets(part.intervals, box, circular) and part.region.near(position, room)


def _joined(parts: Sequence[_Part], first: Sequence[bool], last: Sequence[bool]) -> bool:
    """Whether a path leads from a first part to a last part, changing the half with every step."""
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
