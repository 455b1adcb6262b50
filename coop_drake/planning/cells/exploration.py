"""One exploration of the configuration space at one margin: Algorithm 1 with our order of splits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

from shapely import MultiPolygon, Polygon

from coop_drake.answers.mixed_cell import MixedCell
from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.cells.cell_graph import CellGraph, GraphCell, Kind
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.events import (
    ChannelSearched,
    ExplorationBegan,
    ExplorationEnded,
    ExplorationResumed,
    SliceAdded,
    SliceSplit,
    Watch,
    seen,
)
from coop_drake.planning.cells.halves import Halves
from coop_drake.planning.cells.mixed_cells import mixed_cells
from coop_drake.planning.cells.slices import Slices, holds
from coop_drake.planning.cells.split_rules import SplitOrder
from coop_drake.planning.travel_time import SETTLING_TIME

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
            Verdict.BUDGET: "the budget of slices is spent",
            Verdict.RESOLUTION: "every undecided slice is as narrow as the resolution",
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


class Exploration:
    """Slices, cells and their graph for one question at one margin.

    Args:
        problem: The question.
        workspace: Floor with the margin taken off [m].
        swept: Sweeps of the problem's tree.
        pairs: Self-collision of the problem's tree.
        watch: Called with every event, in order.
        question: What is explored, in words, for the events.
    """

    def __init__(
        self,
        problem: PlanningProblem,
        workspace: Polygon | MultiPolygon,
        swept: SweptTree,
        pairs: BodyPairs,
        watch: Watch | None = None,
        question: str = "the whole team",
    ) -> None:
        self._problem, self._watch = problem, watch
        self._question, self._paused = question, False
        self.swept, self.pairs = swept, pairs
        self.slices = Slices(problem.tree, problem.settings.slice_overlap)
        self.maker = CellMaker(swept, pairs, workspace)
        self.graph = CellGraph(self.slices)
        self._halves = Halves(self.slices, self.maker)
        self.order = SplitOrder(problem, self.slices, self.maker, self._halves)
        self._starts: dict[int, list[GraphCell]] = {}
        self._goals: dict[int, list[int]] = {}
        if watch is not None:
            robots = sorted({joint.robot for joint in problem.tree.joints})
            watch(ExplorationBegan(question, tuple(robots)))
        for index in self.slices.leaves():
            self._add(index, self.maker.over_cells(self.slices.all[index].intervals))

    def run(self, budget: int, progress: Callable[[int], None] | None = None) -> ExplorationResult:
        """Search and split until there is an answer or the budget of slices is spent.

        The path of least weight through FREE and undecided cells is searched, and slices on it are halved in
        the order of ``SplitOrder``. If no path exists at all, the question is infeasible. Call again with a
        larger budget to continue where the exploration stopped.

        Args:
            budget: Compound slices that may exist in all.
            progress: Called with the number of slices after every round of splits.
        """
        if self._watch is not None and self._paused:
            self._watch(ExplorationResumed(self._question))
        self._paused = True
        outcome = self._explored(budget, progress)
        if self._watch is not None:
            self._watch(ExplorationEnded(outcome.verdict.value, outcome.slices))
        return outcome

    def _explored(self, budget: int, progress: Callable[[int], None] | None) -> ExplorationResult:
        while True:
            path = self._cheapest_path()
            if self._watch is not None:
                cost = sum(cell.weight for cell in path or ())
                self._watch(ChannelSearched(seen(path or ()), cost))
            made = len(self.slices.all)
            if path is None:
                return ExplorationResult(Verdict.INFEASIBLE, (), made)
            if all(cell.kind is Kind.FREE for cell in path):
                return ExplorationResult(Verdict.FOUND, tuple(path), made)
            if made >= budget:
                return ExplorationResult(Verdict.BUDGET, tuple(path), made)
            splits = self.order.splits(path)
            if not splits:
                return ExplorationResult(Verdict.RESOLUTION, tuple(path), made)
            for index, axis in splits:
                self._split(index, axis)
            if progress is not None:
                progress(len(self.slices.all))

    def _cheapest_path(self) -> list[GraphCell] | None:
        starts = [cell for index in sorted(self._starts) for cell in self._starts[index]]
        goals = {cell for cells in self._goals.values() for cell in cells}
        return self.graph.cheapest(starts, goals)

    def boxes(self, path: Sequence[GraphCell]) -> list[tuple[Intervals, Region]]:
        """Expanded intervals and region of every cell of a free path."""
        return [(self.slices.expanded(self.slices.all[cell.slice].intervals), cell.region) for cell in path]

    def over_leaves(self) -> dict[int, list[Region]]:
        """Over-cells of every leaf by its id; an empty list where the whole leaf is blocked."""
        return {
            index: [cell.region for cell in self.graph.by_slice[index] if cell.kind is Kind.MIXED]
            for index in self.slices.leaves()
        }

    def undecided(self, path: Sequence[GraphCell]) -> tuple[MixedCell, ...]:
        """Cells of a path that are not proved free, the widest first."""
        return mixed_cells(self._problem, self.slices, self.order.finest, path)

    def _split(self, index: int, axis: int) -> None:
        if self._watch is not None:
            self._watch(SliceSplit(index, axis))
        self.graph.remove(index)
        self._starts.pop(index, None)
        self._goals.pop(index, None)
        parts = self._halves.taken(index, axis)
        for half, part in zip(self.slices.split(index, axis), parts, strict=True):
            self._add(half, part.regions)

    def _add(self, index: int, mixed: Sequence[Region]) -> None:
        intervals = self.slices.all[index].intervals
        free = self.maker.under_cells(self.slices.expanded(intervals)) if mixed else []
        guide = self.maker.guide_cells(intervals) if mixed else []
        final = not self.order.splittable(intervals)
        members = [(Kind.FREE, region, _free_weight(region)) for region in free]
        members += [(Kind.GUIDE, region, GUIDE_WEIGHT) for region in guide if not final]
        weight = FINEST_WEIGHT if final else MIXED_WEIGHT
        members += [(Kind.MIXED, region, weight) for region in mixed]
        self.graph.add(index, members)
        self._note_ends(index, intervals)
        if self._watch is not None:
            self._watch(SliceAdded(index, intervals, seen(self.graph.by_slice[index])))

    def _note_ends(self, index: int, intervals: Intervals) -> None:
        """Record which cells of a new leaf hold the start and which hold the goal."""
        cells = self.graph.by_slice[index]
        start, goal = self._problem.start, self._problem.goal_pose
        if holds(intervals, [float(angle) for angle in start[2:]]):
            self._starts[index] = [cell for cell in cells if cell.region.holds(start[:2])]
        if holds(intervals, [float(goal[2]), *self._problem.goal_joints]):
            self._goals[index] = [cell.index for cell in cells if cell.region.holds(goal[:2])]


def _free_weight(region: Region) -> float:
    """Estimated time to cross a FREE cell: settling of the angles, and more the narrower the cell is [s]."""
    return SETTLING_TIME + TIME_PER_INVERSE_BREADTH / max(region.breadth, LEAST_BREADTH)
