"""The strategy ``paper`` does what Algorithms 1 and 2 say."""

from dataclasses import replace
from itertools import pairwise
from math import pi

import numpy as np
import pytest
from manifold3d import CrossSection

from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.as_printed import PaperExploration, refine
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.exploration import (
    ChannelSearched,
    Event,
    ExplorationResult,
    SliceAdded,
    SliceSplit,
    Verdict,
)
from coop_drake.planning.cells.graph import CellGraph, GraphCell, Kind, Slices
from tests.planning.test_search import rod_problem
from tests.support.cases import team_tree, transport


def explored(
    corridor: float, budget: int = 400, **changes: object
) -> tuple[PaperExploration, ExplorationResult, list[Event]]:
    problem = replace(rod_problem(corridor), **changes)
    events = []
    exploration = PaperExploration(problem, watch=events.append)
    return exploration, exploration.run(budget), events


def test_it_begins_with_one_slice_of_everything() -> None:
    slices = Slices(team_tree(), 0.25, printed=True)
    assert [part.intervals for part in slices.all] == [((-pi, pi), (-1.87, 1.87), (-1.87, 1.87))]
    assert slices.all[0].neighbours == set()


def test_slices_that_meet_in_a_corner_are_adjacent() -> None:
    slices = Slices(team_tree(), 0.25, printed=True)
    _, right = slices.split(0, 0)
    _, upper = slices.split(right, 1)
    lower, _ = slices.split(1, 1)
    assert upper in slices.all[lower].neighbours


def test_a_path_is_found_among_under_cells_of_adjacent_slices() -> None:
    exploration, outcome, _ = explored(0.5)
    assert outcome.verdict is Verdict.FOUND
    assert all(cell.kind is Kind.FREE for cell in outcome.path)
    for one, other in pairwise(outcome.path):
        assert other.slice in exploration.slices.all[one.slice].neighbours
        assert one.region.meets(other.region)


def test_each_search_halves_one_slice_along_its_longest_interval() -> None:
    problem = transport(1.2)
    events = []
    PaperExploration(problem, watch=events.append).run(120)
    intervals: dict[int, Intervals] = {}
    halved = searched = False  # Before the first search the slices of start and goal are halved.
    for event in events:
        if isinstance(event, SliceAdded):
            intervals[event.slice] = event.intervals
        elif isinstance(event, SliceSplit):
            widths = np.ptp(np.array(intervals[event.slice]), axis=1)
            assert widths[event.axis] == widths.max()
            assert not (halved and searched)
            halved = True
        elif isinstance(event, ChannelSearched):
            halved, searched = False, True
    assert searched


def test_no_path_of_over_cells_is_a_proof() -> None:
    _, outcome, events = explored(0.19)
    assert outcome.verdict is Verdict.INFEASIBLE
    assert outcome.path == ()
    assert isinstance(events[-2], ChannelSearched)
    assert events[-2].cells == ()


def test_a_goal_that_no_over_cell_holds_is_infeasible() -> None:
    _, outcome, _ = explored(0.5, goal_pose=np.array([0.0, 0.8, 0.0]))
    assert outcome.verdict is Verdict.INFEASIBLE


def test_a_spent_budget_may_be_raised() -> None:
    exploration, outcome, _ = explored(0.5, budget=5)
    assert outcome.verdict is Verdict.BUDGET
    assert exploration.run(400).verdict is Verdict.FOUND


def region(x: float, width: float = 1.2) -> Region:
    return Region.of(CrossSection.square((width, 1.0)).translate((x, 0.0)))


def cells_of(slices: Slices, *regions_by_slice: list[Region]) -> CellGraph:
    graph = CellGraph(slices)
    for index, regions in enumerate(regions_by_slice):
        graph.add(index, [(Kind.FREE, part, 1.0) for part in regions])
    return graph


@pytest.fixture
def path() -> list[GraphCell]:
    """Over-cells of four slices, side by side."""
    return [GraphCell(i, i, Kind.MIXED, region(float(i)), 1.0) for i in range(4)]


def test_refine_returns_the_first_pair_that_does_not_connect(path: list[GraphCell]) -> None:
    slices = Slices(team_tree(), 0.25)
    under = cells_of(slices, [region(0.0)], [region(1.0)], [region(2.3, 0.5)], [region(3.0)])
    source, goal = under.by_slice[0], under.by_slice[3]
    assert refine(path, source, goal, under) == [1, 2]
    joined = cells_of(slices, [region(0.0)], [region(1.0)], [region(2.0, 0.5)], [region(3.0)])
    assert refine(path, joined.by_slice[0], joined.by_slice[3], joined) == [2, 3]


def test_refine_of_a_single_cell_is_its_slice(path: list[GraphCell]) -> None:
    under = cells_of(Slices(team_tree(), 0.25), [region(0.0)])
    assert refine(path[:1], under.by_slice[0], under.by_slice[0], under) == [0]


def test_refine_accepts_no_cell_of_the_last_slice_but_the_goals(path: list[GraphCell]) -> None:
    under = cells_of(Slices(team_tree(), 0.25), [region(0.0)], [region(1.0), region(1.9, 0.1)])
    source, (near, far) = under.by_slice[0], under.by_slice[1]
    assert refine(path[:2], source, [far], under) == [0, 1]
    assert refine(path[:2], source, [near], under) == [1]
