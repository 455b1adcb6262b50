"""The paper's exploration as printed: Algorithm 1, with Algorithm 2 to choose what is subdivided."""

from __future__ import annotations

from collections.abc import Sequence

from shapely import MultiPolygon, Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.exploration import ExplorationResult, SliceSplit, Subdivision, Verdict, Watch
from coop_drake.planning.cells.graph import CellGraph, GraphCell, Kind
from coop_drake.tree.arrays import FloatArray

End = tuple[list[float | None], FloatArray]


class PaperExploration(Subdivision):
    """Under- and over-approximation cells of one subdivision, refined as the paper prints it.

    Every round halves one slice: the longest simple slice of the first two compound slices on the path of
    over-approximation cells whose under-approximation cells do not connect. The paper does not say when the
    algorithm gives up (erratum EA1); here it stops when the slice to halve is below the resolution.

    Attributes:
        under: Under-approximation cells of the leaves.
        over: Over-approximation cells of the leaves.
    """

    def __init__(
        self,
        problem: PlanningProblem,
        workspace: Polygon | MultiPolygon | None = None,
        watch: Watch | None = None,
    ) -> None:
        super().__init__(problem, workspace, watch, printed=True)
        self._start: End = [float(angle) for angle in problem.start[2:]], problem.start[:2]
        self._goal: End = [float(problem.goal_pose[2]), *problem.goal_joints], problem.goal_pose[:2]
        self.under, self.over = CellGraph(self.slices), CellGraph(self.slices)
        self._add(0)

    def _round(self, budget: int) -> ExplorationResult | None:
        """One pass of Algorithm 1's loop."""
        start = self._find_enclosing(self._start, budget)
        if isinstance(start, ExplorationResult):
            return start
        goal = self._find_enclosing(self._goal, budget)
        if isinstance(goal, ExplorationResult):
            return goal
        (over_start, under_start), (over_goal, under_goal) = start, goal
        path = self._connect(self.under, under_start, under_goal)
        if path:
            return self._result(Verdict.FOUND, path)
        path = self._connect(self.over, over_start, over_goal)
        if not path:
            return self._result(Verdict.INFEASIBLE, path)
        if len(self.slices.all) >= budget:
            return self._result(Verdict.BUDGET, path)
        failing = refine(path, [under_start], [under_goal], self.under)
        return None if self._subdivide_longest(failing) else self._result(Verdict.RESOLUTION, path)

    def _find_enclosing(self, end: End, budget: int) -> tuple[GraphCell, GraphCell] | ExplorationResult:
        """Subdivide until one slice has an over-cell and an under-cell that hold an end; return both."""
        angles, position = end
        while True:
            held = [
                cell
                for index in sorted(self.slices.holding(angles), key=lambda i: (self.slices.all[i].depth, i))
                for cell in self.over.by_slice[index]
                if cell.region.holds(position)
            ]
            if not held:
                return self._result(Verdict.INFEASIBLE, [])
            for over in held:
                for under in self.under.by_slice[over.slice]:
                    if under.region.holds(position):
                        return over, under
            if len(self.slices.all) >= budget:
                return self._result(Verdict.BUDGET, held[:1])
            if not self._subdivide_longest([held[0].slice]):
                return self._result(Verdict.RESOLUTION, held[:1])

    def _connect(self, graph: CellGraph, first: GraphCell, last: GraphCell) -> list[GraphCell]:
        """Path through the cells of one kind that prefers large slices; empty if there is no path."""
        path = graph.cheapest([first], {last.index}) or []
        if path or graph is self.over:
            self._searched(path)
        return path

    def _subdivide_longest(self, indices: Sequence[int]) -> bool:
        """Halve the longest simple slice of some compound slices; return False if it is below the resolution.

        Lengths are compared as numbers, radians with metres, because the paper does not weigh them.
        """
        widths = {
            (index, axis): upper - lower
            for index in indices
            for axis, (lower, upper) in enumerate(self.slices.all[index].intervals)
        }
        index, axis = max(widths, key=lambda key: widths[key])
        if widths[index, axis] <= self.finest[axis]:
            return False
        self._tell(SliceSplit(index, axis))
        self.under.remove(index)
        self.over.remove(index)
        for half in self.slices.split(index, axis):
            self._add(half)
        return True

    def _add(self, index: int) -> None:
        part = self.slices.all[index]
        over = self.maker.over_cells(part.intervals)
        under = self.maker.under_cells(self.slices.expanded(part.intervals)) if over else []
        weight = 1.0 + part.depth
        self.over.add(index, [(Kind.MIXED, region, weight) for region in over])
        self.under.add(index, [(Kind.FREE, region, weight) for region in under])
        cells = [*self.under.by_slice[index], *self.over.by_slice[index]]
        self._added(index, cells)

    def over_leaves(self) -> dict[int, list[Region]]:
        """Over-cells of every leaf by its id; an empty list where the whole leaf is blocked."""
        return {index: [cell.region for cell in self.over.by_slice[index]] for index in self.slices.leaves()}


def refine(
    path: Sequence[GraphCell], source: Sequence[GraphCell], goal: Sequence[GraphCell], under: CellGraph
) -> list[int]:
    """Algorithm 2: follow a path of over-cells with the under-cells inside them until these do not connect.

    The printed algorithm accepts all under-cells of a slice, also those outside the path (erratum EA2).

    Args:
        path: Over-approximation cells.
        source: Under-approximation cells of the first one's slice that are reached.
        goal: Under-approximation cells to reach in the last one's.
        under: All under-approximation cells.

    Returns:
        The slices of which the longest simple slice is to be halved: the first pair that does not connect,
        or the last slice of the path.
    """
    if len(path) == 1:
        return [path[0].slice]
    here = path[1]
    cells = [cell for cell in under.by_slice[here.slice] if cell.region.meets(here.region)]
    if len(path) == 2:
        cells = list(goal)
    connected = [cell for cell in cells if any(one.region.meets(cell.region) for one in source)]
    if connected:
        return refine(path[1:], connected, goal, under)
    return [path[0].slice, here.slice]
