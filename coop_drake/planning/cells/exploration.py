"""Exploration of the configuration space by cells of slices, and which slice it splits next."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from shapely import MultiPolygon, Polygon

from coop_drake.answers.plan import MixedCell
from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.geometry.minkowski import shared, to_polygon
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, FreeBox, Region
from coop_drake.planning.cells.graph import (
    CellGraph,
    GraphCell,
    Kind,
    Slices,
    halves,
    holds,
    meets,
    share_facet,
)
from coop_drake.planning.duration import SETTLING_TIME
from coop_drake.planning.questions import end_in
from coop_drake.tree.component_tree import axis_levers

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


class SplitOrder:
    """Chooses the splits of one exploration; cells are halved on trial (strong branching).

    Args:
        problem: Start and goal, where paths begin and end.
        slices: The subdivision.
        maker: Makes the cells of slices.
    """

    def __init__(self, problem: PlanningProblem, slices: Slices, maker: CellMaker) -> None:
        self._slices, self._maker = slices, maker
        self._levers = axis_levers(problem.tree)
        self._finest = finest_widths(problem)
        self._times_blocking: Counter[int] = Counter()
        self._start = [float(angle) for angle in problem.start[2:]], problem.start[:2]
        self._goal = goal_box(problem), problem.goal_pose[:2], problem.position_tolerance

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
            blocking = [axis for axis in self.blocking_axes(path, place) if axis in sweeps]
            sweeps = {axis: sweeps[axis] for axis in blocking} or sweeps
        furthest = max(sweeps.values())
        trials = [
            self.trial(path, place, axis)
            for axis, sweep in sweeps.items()
            if sweep * LARGEST_SWEEP_RATIO >= furthest
        ]
        separating = [trial for trial in trials if trial.disconnects]
        contact = None if separating else self._contact_axis(cell, intervals, sweeps)
        if contact is not None:
            return self.trial(path, place, contact)
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
        pair = self._maker.pairs.touching(probe)
        involved = [axis for axis in pair.axes if axis in sweeps] if pair is not None else []
        axis = max(involved, key=lambda axis: (sweeps[axis], -axis), default=None)
        too_fine = axis is None or LARGEST_CONTACT_SWEEP_RATIO * sweeps[axis] < max(sweeps.values())
        return None if too_fine else axis

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


def finest_widths(problem: PlanningProblem) -> tuple[float, ...]:
    """Resolution of every axis (theta, q...): intervals that are no wider are not halved [rad or m]."""
    angle, length = problem.settings.angle_resolution, problem.settings.length_resolution
    return (angle, *(angle if joint.kind == "revolute" else length for joint in problem.tree.joints))


# Explorations of the configuration space at one margin; Algorithm 1 with our order of splits.

# Events of an exploration, one for each step, for displays of the search.


@dataclass(frozen=True, eq=False)
class ExplorationBegan:
    """A question is explored from its coarsest slices on.

    Attributes:
        question: What is explored, in words: the whole team or a part of it.
        robots: Robots that take part.
    """

    question: str
    robots: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class ExplorationResumed:
    """An exploration continues after other explorations had their turn.

    Attributes:
        question: What is explored, as in ``ExplorationBegan``.
    """

    question: str


@dataclass(frozen=True, eq=False)
class SliceAdded:
    """A new leaf of the subdivision.

    Attributes:
        slice: Its id.
        intervals: Nominal interval of every axis (theta, q...) [rad, m].
        cells: Its cells, ordered FREE, GUIDE, MIXED; empty where the whole slice is blocked.
    """

    slice: int
    intervals: Intervals
    cells: tuple[GraphCell, ...]


@dataclass(frozen=True, eq=False)
class SliceSplit:
    """A leaf is halved; two events ``SliceAdded`` for its halves follow.

    Attributes:
        slice: Its id.
        axis: Which axis of (theta, q...) is halved.
    """

    slice: int
    axis: int


@dataclass(frozen=True, eq=False)
class ChannelSearched:
    """The cheapest path of cells from start to goal was searched.

    Attributes:
        cells: The path; empty if none exists, which proves infeasibility.
        cost: Its total weight, 0 for an empty path.
    """

    cells: tuple[GraphCell, ...]
    cost: float


@dataclass(frozen=True, eq=False)
class ExplorationEnded:
    """A run of the exploration stopped.

    Attributes:
        verdict: Value of its ``Verdict``; after "budget spent" the exploration may be resumed.
        slices: Compound slices made so far.
    """

    verdict: str
    slices: int


Event = ExplorationBegan | ExplorationResumed | SliceAdded | SliceSplit | ChannelSearched | ExplorationEnded
Watch = Callable[[Event], None]


TIME_PER_INVERSE_BREADTH = 0.03
"""Weight of a FREE cell for its narrowness, times its breadth (area over perimeter) [s m]."""

LEAST_BREADTH = 1e-3
"""Breadths are counted as at least this, so that weights stay finite [m]."""

GUIDE_WEIGHT = 10.0
"""Weight of a GUIDE cell [s]: above that of FREE cells, below that of MIXED cells, which may be blocked."""

MIXED_WEIGHT = 100.0
"""Weight of a MIXED cell [s]: paths avoid it wherever a longer path through likely free cells exists."""

FINEST_WEIGHT = 1e4
"""Weight of a MIXED cell that cannot be halved any more [s]: it is passed only if nothing else is left."""


class Verdict(Enum):
    """How an exploration ended."""

    FOUND = "found"
    INFEASIBLE = "infeasible"
    RESOLUTION = "below resolution"
    BUDGET = "budget spent"

    def explanation(self, slices: int) -> str:
        """Why an exploration of so many slices ended without an answer, in a sentence."""
        why = {
            Verdict.BUDGET: "the budget planner.max_slices is spent",
            Verdict.RESOLUTION: "every undecided slice is as narrow as planner.angle_resolution and "
            "planner.length_resolution allow",
        }
        return f"no answer after {slices} slices: {why.get(self, self.value)}"


@dataclass(frozen=True)
class ExplorationResult:
    """Result of one exploration.

    Attributes:
        verdict: How it ended.
        path: Cells from start to goal that were found last; all FREE if found, empty if infeasible.
        slices: Compound slices made.
    """

    verdict: Verdict
    path: tuple[GraphCell, ...]
    slices: int


class Subdivision(ABC):
    """Slices and their cells for one question at one margin, halved until there is an answer.

    Args:
        problem: The question.
        workspace: Floor with the margin taken off [m]; None for the floor itself.
        watch: Called with every event, in order.
        question: What is explored, in words, for the events.
        printed: Whether slices begin and adjoin as the paper prints it, see ``Slices``.
    """

    def __init__(
        self,
        problem: PlanningProblem,
        workspace: Polygon | MultiPolygon | None = None,
        watch: Watch | None = None,
        question: str = "the whole team",
        *,
        printed: bool = False,
    ) -> None:
        self._problem, self._watch = problem, watch
        self._question, self._paused = question, False
        self.swept = SweptTree(problem.tree)
        self.slices = Slices(problem.tree, problem.settings.slice_overlap, printed=printed)
        floor = problem.workspace if workspace is None else workspace
        self.maker = CellMaker(self.swept, floor, squeezing=not printed)
        self.finest = finest_widths(problem)
        self._robots = tuple(sorted({joint.robot for joint in problem.tree.joints}))
        self._tell(ExplorationBegan(question, self._robots))

    def run(self, budget: int, progress: Callable[[int], None] | None = None) -> ExplorationResult:
        """Search and split until there is an answer or the budget of slices is spent.

        Call again with a larger budget to continue where the exploration stopped.

        Args:
            budget: Compound slices that may exist in all.
            progress: Called with the number of slices after every round of splits.
        """
        if self._paused:
            self._tell(ExplorationResumed(self._question))
        self._paused = True
        while (outcome := self._round(budget)) is None:
            if progress is not None:
                progress(len(self.slices.all))
        self._tell(ExplorationEnded(outcome.verdict.value, outcome.slices))
        return outcome

    @abstractmethod
    def _round(self, budget: int) -> ExplorationResult | None:
        """Search once and split; None if the exploration goes on."""

    @abstractmethod
    def over_leaves(self) -> dict[int, list[Region]]:
        """Over-cells of every leaf by its id; an empty list where the whole leaf is blocked."""

    def boxes(self, path: Sequence[GraphCell]) -> list[FreeBox]:
        """The boxes of a free path: its cells with the expanded intervals of their slices."""
        expanded = (self.slices.expanded(self.slices.all[cell.slice].intervals) for cell in path)
        return [FreeBox.of(intervals, cell.region) for intervals, cell in zip(expanded, path, strict=True)]

    def undecided(self, path: Sequence[GraphCell]) -> tuple[MixedCell, ...]:
        """Cells of a path that are not proved free, the widest first."""
        cells, finest = [], np.array(self.finest)
        for cell in path:
            if cell.kind is not Kind.FREE:
                lower, upper = np.array(self.slices.all[cell.slice].intervals).T.copy()
                fraction = float(((upper - lower) / np.array(self.slices.axis_widths)).max())
                done = bool((upper - lower <= finest).all())
                polygon = to_polygon(cell.region.section)
                cells.append(MixedCell(self._robots, lower, upper, polygon, fraction, done))
        return tuple(sorted(cells, key=lambda cell: -cell.width_fraction))

    def _tell(self, event: Event) -> None:
        if self._watch is not None:
            self._watch(event)

    def _searched(self, path: Sequence[GraphCell]) -> None:
        if self._watch is not None:
            self._watch(ChannelSearched(tuple(path), sum(cell.weight for cell in path)))

    def _added(self, index: int, cells: Sequence[GraphCell]) -> None:
        if self._watch is not None:
            self._watch(SliceAdded(index, self.slices.all[index].intervals, tuple(cells)))

    def _result(self, verdict: Verdict, path: Sequence[GraphCell]) -> ExplorationResult:
        return ExplorationResult(verdict, tuple(path), len(self.slices.all))


class Exploration(Subdivision):
    """A subdivision whose path of least weight is searched, and halved in the order of ``SplitOrder``.

    The path leads through FREE and undecided cells. If no path exists at all, the question is infeasible.
    """

    def __init__(
        self,
        problem: PlanningProblem,
        workspace: Polygon | MultiPolygon | None = None,
        watch: Watch | None = None,
        question: str = "the whole team",
    ) -> None:
        super().__init__(problem, workspace, watch, question)
        self.graph = CellGraph(self.slices)
        self.order = SplitOrder(problem, self.slices, self.maker)
        self._starts: dict[int, list[GraphCell]] = {}
        self._goals: dict[int, list[int]] = {}
        for index in self.slices.leaves():
            self._add(index)

    def _round(self, budget: int) -> ExplorationResult | None:
        starts = [cell for index in sorted(self._starts) for cell in self._starts[index]]
        path = self.graph.cheapest(starts, {cell for cells in self._goals.values() for cell in cells})
        self._searched(path or ())
        if path is None:
            return self._result(Verdict.INFEASIBLE, ())
        if all(cell.kind is Kind.FREE for cell in path):
            return self._result(Verdict.FOUND, path)
        if len(self.slices.all) >= budget:
            return self._result(Verdict.BUDGET, path)
        splits = self.order.splits(path)
        for index, axis in splits:
            self._split(index, axis)
        return None if splits else self._result(Verdict.RESOLUTION, path)

    def over_leaves(self) -> dict[int, list[Region]]:
        """Over-cells of every leaf by its id; an empty list where the whole leaf is blocked."""
        return {
            index: [cell.region for cell in self.graph.by_slice[index] if cell.kind is Kind.MIXED]
            for index in self.slices.leaves()
        }

    def _split(self, index: int, axis: int) -> None:
        self._tell(SliceSplit(index, axis))
        self.graph.remove(index)
        self._starts.pop(index, None)
        self._goals.pop(index, None)
        for half in self.slices.split(index, axis):
            self._add(half)

    def _add(self, index: int) -> None:
        intervals = self.slices.all[index].intervals
        mixed = self.maker.over_cells(intervals)
        free = self.maker.under_cells(self.slices.expanded(intervals)) if mixed else []
        guide = self.maker.guide_cells(intervals) if mixed else []
        final = not self.order.splittable(intervals)
        # A FREE cell takes the time in which angles settle, and more the narrower it is.
        members = [
            (Kind.FREE, cell, SETTLING_TIME + TIME_PER_INVERSE_BREADTH / max(cell.breadth, LEAST_BREADTH))
            for cell in free
        ]
        members += [(Kind.GUIDE, region, GUIDE_WEIGHT) for region in guide if not final]
        weight = FINEST_WEIGHT if final else MIXED_WEIGHT
        members += [(Kind.MIXED, region, weight) for region in mixed]
        self.graph.add(index, members)
        self._note_ends(index, intervals)
        self._added(index, self.graph.by_slice[index])

    def _note_ends(self, index: int, intervals: Intervals) -> None:
        """Record which cells of a new leaf hold the start, and in which a path may end.

        That is all that share a point with the goal. Free ones hold its middle, or else have room for an end
        in a slice about the middle's angles, in which the middle's position is not free.
        """
        cells, problem, circular = self.graph.by_slice[index], self._problem, self.slices.circular
        start, goal, room = problem.start, problem.goal_pose, problem.position_tolerance
        if holds(intervals, [float(angle) for angle in start[2:]], circular):
            self._starts[index] = [cell for cell in cells if cell.region.holds(start[:2])]
        if not meets(intervals, goal_box(problem), circular):
            return
        near = [cell for cell in cells if cell.region.near(goal[:2], room)]
        ends = [cell.index for cell in near if cell.kind is not Kind.FREE]
        if holds(intervals, [float(goal[2]), *problem.goal_joints], circular):
            free, expanded = [c for c in near if c.kind is Kind.FREE], self.slices.expanded(intervals)
            blocked = not any(c.region.holds(goal[:2]) for c in near if c.kind is Kind.MIXED)
            ends += [
                c.index
                for c in free
                if c.region.holds(goal[:2])
                or (blocked and end_in(problem, expanded, c.region.boundary) is not None)
            ]
        self._goals[index] = ends
