"""Explorations of the configuration space at one margin; Algorithm 1 with our order of splits."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from shapely import MultiPolygon, Polygon

from coop_drake.answers.plan import MixedCell
from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.geometry.minkowski import to_polygon
from coop_drake.geometry.swept_tree import BodyPairs, Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, FreeBox, Region, end_in
from coop_drake.planning.cells.graph import CellGraph, GraphCell, Kind
from coop_drake.planning.cells.slices import Slices, holds, meets
from coop_drake.planning.cells.splitting import SplitOrder, finest_widths
from coop_drake.planning.duration import SETTLING_TIME

# Events of an exploration, one for each step, for displays of the search.


@dataclass(frozen=True, eq=False)
class SeenCell:
    """A cell of the graph, as events show it.

    Attributes:
        slice: Id of its slice.
        kind: What is known about it.
        region: Positions p_WL.
    """

    slice: int
    kind: Kind
    region: Region


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
    cells: tuple[SeenCell, ...]


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

    cells: tuple[SeenCell, ...]
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


def seen(cells: Sequence[GraphCell]) -> tuple[SeenCell, ...]:
    """Cells of the graph, as events show them."""
    return tuple(SeenCell(cell.slice, cell.kind, cell.region) for cell in cells)


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
        self.pairs = BodyPairs(self.swept)
        self.slices = Slices(problem.tree, problem.settings.slice_overlap, printed=printed)
        floor = problem.workspace if workspace is None else workspace
        self.maker = CellMaker(self.swept, self.pairs, floor, squeezing=not printed)
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
            self._watch(ChannelSearched(seen(path), sum(cell.weight for cell in path)))

    def _added(self, index: int, cells: Sequence[GraphCell]) -> None:
        if self._watch is not None:
            self._watch(SliceAdded(index, self.slices.all[index].intervals, seen(cells)))

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
        path = self._cheapest_path()
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

    def _cheapest_path(self) -> list[GraphCell] | None:
        starts = [cell for index in sorted(self._starts) for cell in self._starts[index]]
        goals = {cell for cells in self._goals.values() for cell in cells}
        return self.graph.cheapest(starts, goals)

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
        members = [(Kind.FREE, region, _free_weight(region)) for region in free]
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


def _free_weight(region: Region) -> float:
    """Estimated time to cross a FREE cell: settling of the angles, and more the narrower the cell is [s]."""
    return SETTLING_TIME + TIME_PER_INVERSE_BREADTH / max(region.breadth, LEAST_BREADTH)
