"""The order of splits: which slices of a path are halved next, and along which axis (strong branching)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.geometry.minkowski import shared
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.graph import GraphCell, Kind
from coop_drake.planning.cells.slices import Slices, halves, holds, meets, share_facet
from coop_drake.tree.component_tree import axis_levers

# Strong branching: halve a cell of a path on trial, and see what remains of the path.


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


# 1. Slices: those of MIXED cells first. Only if the path has none, those of GUIDE cells.
# 2. Axes: those wider than the resolution. In a MIXED cell where one component alone blocks the path in the
#    middle of the slice, only the axes that move this component.
# 3. Every such axis is halved on trial, except those along which the team sweeps far less than along others.
# 4. An axis whose halving disconnects the path wins; on a path with such slices, only these are halved.
# 5. Otherwise an axis that may separate two bodies that touch wins; otherwise the one that leaves the
#    smallest area of over-cells; if these areas are equal, the axis along which the team sweeps furthest.
#
# Every ``Exploration`` uses this order: proofs of infeasibility, the clearance bound, the strategy
# ``cells``. The sampled search of ``portfolio`` and the strategy ``paper`` (``as_printed.py``) do
# not.

LARGEST_SWEEP_RATIO = 16.0
"""An axis is not tried if another axis of the slice sweeps the team this many times as far [-]: halving it
would make slices so thin that its own halvings show no effect."""

EQUAL_AREA_FRACTION = 1e-3
"""Trials whose areas differ by less than this fraction of the cell's area are called equal [-]."""

LARGEST_CONTACT_SWEEP_RATIO = 2.0
"""An axis that may separate two bodies is preferred unless another axis sweeps more than twice as far [-]."""


class SplitOrder:
    """Chooses the splits of one exploration."""

    def __init__(self, problem: PlanningProblem, slices: Slices, maker: CellMaker) -> None:
        self._slices, self._maker = slices, maker
        self._levers = axis_levers(problem.tree)
        self._branching = StrongBranching(problem, slices, maker)
        self._finest = finest_widths(problem)

    def splittable(self, intervals: Intervals) -> list[int]:
        """Axes of a slice that are wider than the resolution."""
        return [
            axis
            for axis, ((lower, upper), finest) in enumerate(zip(intervals, self._finest, strict=True))
            if upper - lower > finest
        ]

    def splits(self, path: Sequence[GraphCell]) -> list[tuple[int, int]]:
        """Choose the slices to halve, each with its axis.

        Args:
            path: Cells from the start to the goal.

        Returns:
            Slice ids and axes; empty if every undecided slice of the path is below the resolution.
        """
        best = [(path[place].slice, self._best(path, place)) for place in self._undecided(path)]
        separating = [(index, trial.axis) for index, trial in best if trial.disconnects]
        return separating or [(index, trial.axis) for index, trial in best]

    def _undecided(self, path: Sequence[GraphCell]) -> list[int]:
        """Places on the path of the cells to halve, one for each slice."""
        places: dict[Kind, dict[int, int]] = {Kind.MIXED: {}, Kind.GUIDE: {}}
        for place, cell in enumerate(path):
            if cell.kind is not Kind.FREE and self.splittable(self._slices.all[cell.slice].intervals):
                places[cell.kind].setdefault(cell.slice, place)
        return list((places[Kind.MIXED] or places[Kind.GUIDE]).values())

    def _best(self, path: Sequence[GraphCell], place: int) -> TrialSplit:
        """Halve the cell at a place along every useful axis on trial and return the best trial."""
        cell = path[place]
        intervals = self._slices.all[cell.slice].intervals
        sweeps = {
            axis: (intervals[axis][1] - intervals[axis][0]) * self._levers[axis]
            for axis in self.splittable(intervals)
        }
        if cell.kind is Kind.MIXED:
            blocking = [axis for axis in self._branching.blocking_axes(path, place) if axis in sweeps]
            sweeps = {axis: sweeps[axis] for axis in blocking} or sweeps
        furthest = max(sweeps.values())
        trials = [
            self._branching.trial(path, place, axis)
            for axis, sweep in sweeps.items()
            if sweep * LARGEST_SWEEP_RATIO >= furthest
        ]
        separating = [trial for trial in trials if trial.disconnects]
        contact = None if separating else self._contact_axis(cell, intervals, sweeps)
        if contact is not None:
            return self._branching.trial(path, place, contact)
        trials = separating or trials
        areas = [trial.area for trial in trials]
        if max(areas) - min(areas) <= EQUAL_AREA_FRACTION * cell.region.area:
            return max(trials, key=lambda trial: (sweeps[trial.axis], -trial.axis))
        return min(trials, key=lambda trial: (trial.area, trial.axis))

    def _contact_axis(self, cell: GraphCell, intervals: Intervals, sweeps: dict[int, float]) -> int | None:
        """Return the axis that may separate two bodies in contact, or None if there is no such axis.

        In a MIXED cell the contact counts if it is at the slice's middle, because walls may block the rest.
        In a GUIDE cell, whose middle is free, it counts anywhere: the slice has no under-cell because of it.
        """
        middle = tuple((0.5 * (lower + upper), 0.5 * (lower + upper)) for lower, upper in intervals)
        probe = self._slices.expanded(intervals) if cell.kind is Kind.GUIDE else middle
        pair = self._maker.touching_pair(probe)
        involved = [axis for axis in pair.axes if axis in sweeps] if pair is not None else []
        axis = max(involved, key=lambda axis: (sweeps[axis], -axis), default=None)
        too_fine = axis is None or LARGEST_CONTACT_SWEEP_RATIO * sweeps[axis] < max(sweeps.values())
        return None if too_fine else axis


def finest_widths(problem: PlanningProblem) -> tuple[float, ...]:
    """Resolution of every axis (theta, q...): intervals that are no wider are not halved [rad or m]."""
    angle, length = problem.settings.angle_resolution, problem.settings.length_resolution
    return (angle, *(angle if joint.kind == "revolute" else length for joint in problem.tree.joints))
