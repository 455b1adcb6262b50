"""Slices and their cells: explorations, also as the paper prints them, and with geometry that fails."""

from collections.abc import Collection
from dataclasses import replace
from itertools import pairwise, product
from math import inf, pi

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import CrossSection
from shapely import Point, Polygon
from shapely.errors import GEOSException

from coop_drake.answers.problem import PlannerSettings
from coop_drake.geometry.minkowski import SAFE_SIDE, FreeSpace
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.as_printed import PaperExploration
from coop_drake.planning.cells.exploration import (
    ChannelSearched,
    Event,
    Exploration,
    ExplorationResult,
    SliceAdded,
    SliceSplit,
    Verdict,
)
from coop_drake.planning.cells.graph import Slices, interval_overlap
from coop_drake.planning.channel import Channel, NoChannel, unwrapped
from coop_drake.planning.questions import relaxed
from coop_drake.planning.search import find_channel
from coop_drake.tree.component_tree import ComponentTree
from tests.geometry.test_minkowski import as_shapely, exact_difference
from tests.planning.test_search import rod_problem
from tests.support.cases import case, team_tree, transport
from tests.support.soundness import assert_channel_is_sound, no_channel
from tests.support.trees import room


def tree_with(circles: Collection[int] = ()) -> ComponentTree:
    """The team, some of whose joints have no limits."""
    components = [
        component
        if component.joint is None or component.joint.index not in circles
        else replace(component, joint=replace(component.joint, lower=-inf, upper=inf))
        for component in team_tree().components
    ]
    return ComponentTree(tuple(components), frozenset())


def cover(splits: list[tuple[int, int]], circles: Collection[int] = ()) -> Slices:
    slices = Slices(tree_with(circles), 0.25)
    for pick, axis in splits:
        leaves = slices.leaves()
        slices.split(leaves[pick % len(leaves)], axis)
    return slices


SPLITS = st.lists(st.tuples(st.integers(0, 100), st.integers(0, 2)), max_size=25)
CIRCLES = st.sampled_from([(), (0,), (1,), (0, 1)])


def beside(one: Intervals, other: Intervals, circular: tuple[bool, ...]) -> bool:
    """Whether two boxes share a facet in one of the places that whole turns lead to."""
    for turns in product(*[(-2.0 * pi, 0.0, 2.0 * pi) if periodic else (0.0,) for periodic in circular]):
        moved = [(low + turn, high + turn) for (low, high), turn in zip(other, turns, strict=True)]
        shared = [min(a[1], b[1]) - max(a[0], b[0]) for a, b in zip(one, moved, strict=True)]
        if min(shared) > -1e-9 and sum(length < 1e-9 for length in shared) <= 1:
            return True
    return False


@given(SPLITS, CIRCLES, *[st.floats(-10, 10)] * 3)
def test_leaves_cover_every_angle(
    splits: list, circles: tuple[int, ...], theta: float, q0: float, q1: float
) -> None:
    held = [q if k in circles else 0.187 * q for k, q in enumerate((q0, q1))]
    assert cover(splits, circles).holding([theta, *held])


@given(SPLITS, CIRCLES)
def test_neighbours_are_exactly_the_leaves_that_share_a_facet(splits: list, circles: tuple[int, ...]) -> None:
    """On every circular axis the first and the last slice meet, of whatever widths they are."""
    slices = cover(splits, circles)
    leaves = slices.leaves()
    for i in leaves:
        expected = {
            j
            for j in leaves
            if j != i and beside(slices.all[i].intervals, slices.all[j].intervals, slices.circular)
        }
        assert slices.all[i].neighbours == expected


@given(SPLITS, CIRCLES)
def test_expanded_neighbours_overlap_with_interior(splits: list, circles: tuple[int, ...]) -> None:
    slices = cover(splits, circles)
    for i in slices.leaves():
        mine = slices.expanded(slices.all[i].intervals)
        inside = [-1.87 <= lower < upper <= 1.87 for lower, upper in mine[1:]]
        assert all(held or k in circles for k, held in enumerate(inside))
        for j in slices.all[i].neighbours:
            other = slices.expanded(slices.all[j].intervals)
            assert all(
                interval_overlap(a, b, periodic) > 0.0
                for a, b, periodic in zip(mine, other, slices.circular, strict=True)
            )


@given(SPLITS, CIRCLES, st.lists(st.integers(0, 200), min_size=1, max_size=12))
def test_boxes_of_a_way_through_neighbours_lie_beside_each_other(
    splits: list, circles: tuple[int, ...], picks: list[int]
) -> None:
    """Each box of a channel overlaps the next one where whole turns have moved it, however far it winds."""
    slices = cover(splits, circles)
    way = [slices.leaves()[0]]
    for pick in picks:
        beyond = sorted(slices.all[way[-1]].neighbours)
        way.append(beyond[pick % len(beyond)])
    boxes = [slices.expanded(slices.all[leaf].intervals) for leaf in way]
    start = [
        0.5 * (low + high) + 6.0 * pi * on for (low, high), on in zip(boxes[0], slices.circular, strict=True)
    ]
    moved = unwrapped(boxes, start, slices.circular)
    assert all(low < value < high for value, (low, high) in zip(start, moved[0], strict=True))
    for one, other in pairwise(moved):
        assert all(min(a[1], b[1]) > max(a[0], b[0]) for a, b in zip(one, other, strict=True))
    for before, after in zip(boxes, moved, strict=True):
        turns = [(b[0] - a[0]) / (2.0 * pi) for a, b in zip(before, after, strict=True)]
        assert np.allclose(turns, np.where(slices.circular, np.round(turns), 0.0))


# Explorations: their channels, their cheapest paths, their events, and searches by cells alone.


@pytest.mark.parametrize("budget", [12, 60, 2000])
def test_the_path_that_is_split_is_the_cheapest_one(budget: int) -> None:
    exploration = Exploration(rod_problem(0.5))
    outcome = exploration.run(budget)
    cells, graph = exploration.graph.by_slice, nx.DiGraph()
    for cell in (cell for index in cells for cell in cells[index]):
        for other in (
            other for near in exploration.slices.all[cell.slice].neighbours for other in cells[near]
        ):
            if cell.region.meets(other.region):
                graph.add_edge(cell.index, other.index, weight=other.weight)
    first, last = outcome.path[0], outcome.path[-1]
    assert first.region.holds(exploration._problem.start[:2])
    least = nx.dijkstra_path_length(graph, first.index, last.index)
    along = sum(graph.edges[one.index, other.index]["weight"] for one, other in pairwise(outcome.path))
    assert along == pytest.approx(least, rel=1e-12)


@pytest.mark.parametrize(("name", "robots"), [("base", ()), ("base", (1,)), ("three", (2,)), ("elbow", ())])
def test_no_relaxation_of_a_feasible_case_is_infeasible(name: str, robots: tuple[int, ...]) -> None:
    question, joints = relaxed(case(name), robots)
    assert len(joints) == len(question.tree.joints) == len(question.goal_joints)
    outcome = Exploration(question).run(150)
    assert outcome.verdict in (Verdict.FOUND, Verdict.BUDGET)


def test_a_relaxation_is_the_same_team_with_robots_left_out() -> None:
    problem = case("elbow")
    question, joints = relaxed(problem, (1,))
    assert joints == (2, 3)
    z = np.array([1.0, 2.0, 0.3, 0.1, -0.2, 0.4, 0.6])
    whole = dict(zip((c.name for c in problem.tree.components), problem.tree.poses(z), strict=True))
    part = question.tree.poses(np.concatenate((z[:3], z[5:])))
    for component, X_WC in zip(question.tree.components, part, strict=True):
        assert whole[component.name] == X_WC


# Explorations by cells alone: same answers, sound channels, proofs that can be checked again.


@pytest.mark.parametrize("strategy", ["cells", "paper"])
def test_a_channel_is_found_and_sound(strategy: str) -> None:
    problem = rod_problem(0.5, PlannerSettings(strategy=strategy))
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert channel.margin == 0.0
    assert_channel_is_sound(problem, channel)


@pytest.mark.parametrize("strategy", ["cells", "paper"])
def test_a_corridor_narrower_than_the_rod_is_refuted(strategy: str) -> None:
    answer = no_channel(rod_problem(0.19, PlannerSettings(strategy=strategy)))
    assert answer.proof is not None
    assert answer.proof.kind == "slices"


@pytest.mark.parametrize("strategy", ["cells", "paper"])
def test_undecided_says_what_remained_mixed(strategy: str) -> None:
    answer = no_channel(rod_problem(0.203, PlannerSettings(strategy=strategy, max_slices=8)), proved=False)
    assert answer.mixed
    assert answer.mixed[0].width_fraction == max(cell.width_fraction for cell in answer.mixed)


def test_cells_alone_refute_in_the_full_space() -> None:
    answer, report = find_channel(case("closed", PlannerSettings(strategy="cells")))
    assert isinstance(answer, NoChannel)
    assert answer.proved
    assert report.slices < 400


# The strategy ``paper`` does what Algorithms 1 and 2 say.


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


def test_a_goal_that_no_over_cell_holds_is_infeasible() -> None:
    _, outcome, _ = explored(0.5, goal_pose=np.array([0.0, 0.8, 0.0]))
    assert outcome.verdict is Verdict.INFEASIBLE


def test_a_spent_budget_may_be_raised() -> None:
    exploration, outcome, _ = explored(0.5, budget=5)
    assert outcome.verdict is Verdict.BUDGET
    assert exploration.run(400).verdict is Verdict.FOUND


# Geometry libraries that fail now and then: verdicts degrade to undecided, never to a wrong one.

SQUARE = np.array([[-0.3, -0.2], [0.4, -0.2], [0.4, 0.3], [-0.3, 0.3]])
CLIPPED = FreeSpace._clipped


def raising(*arguments) -> CrossSection:
    raise RuntimeError("the clipping library gave up")


def topology_fails(*arguments):
    raise GEOSException("TopologyException: side location conflict")


def nothing(space: FreeSpace, footprint: np.ndarray) -> CrossSection:
    return CrossSection()


def everything(space: FreeSpace, footprint: np.ndarray) -> CrossSection:
    return CrossSection.square((50.0, 50.0), center=True)


def now_and_then(failure, every: int):
    """Clipping in which each so many-th difference fails."""
    calls = iter(range(1_000_000_000))
    return lambda space, footprint: (failure if next(calls) % every == 0 else CLIPPED)(space, footprint)


@pytest.mark.parametrize("failure", [raising, nothing, everything])
def test_a_failed_difference_frees_nothing_and_blocks_no_more_than_the_truth(monkeypatch, failure) -> None:
    monkeypatch.setattr(FreeSpace, "_clipped", failure)
    exact = exact_difference(room(), SQUARE)
    assert FreeSpace.under(room()).minus(SQUARE).is_empty()
    over = as_shapely(FreeSpace.over(room()).minus(SQUARE))
    assert over.covers(exact)
    assert over.symmetric_difference(exact).area < 1e-3


def test_where_both_libraries_fail_nothing_is_blocked(monkeypatch) -> None:
    monkeypatch.setattr(FreeSpace, "_clipped", raising)
    space, exact = FreeSpace.over(room()), exact_difference(room(), SQUARE)
    with monkeypatch.context() as broken:
        broken.setattr(shapely, "union_all", topology_fails)
        found = space.minus(SQUARE)
    assert as_shapely(found).covers(exact)


@pytest.mark.parametrize("distance", [SAFE_SIDE, -SAFE_SIDE])
@pytest.mark.parametrize("kind", ["raises", "is empty", "is far away"])
def test_a_failed_buffer_frees_nothing_and_blocks_nothing(monkeypatch, distance: float, kind: str) -> None:
    def fail(shape, distance, **options):
        if kind == "raises":
            topology_fails()
        return Polygon() if kind == "is empty" else Point(50.0, 50.0).buffer(1.0)

    with monkeypatch.context() as broken:
        broken.setattr(Polygon, "buffer", fail)
        space = FreeSpace.over(room()) if distance > 0.0 else FreeSpace.under(room())
    if distance < 0.0:
        assert space.minus(SQUARE).is_empty()
    else:
        assert as_shapely(space.minus(SQUARE)).covers(exact_difference(room(), SQUARE))


@settings(max_examples=12)
@given(st.sampled_from((raising, nothing, everything)), st.integers(1, 9), st.sampled_from((0.19, 0.3)))
def test_no_exploration_errs_however_often_clipping_fails(failure, every: int, corridor: float) -> None:
    problem = rod_problem(corridor)
    with pytest.MonkeyPatch.context() as broken:
        broken.setattr(FreeSpace, "_clipped", now_and_then(failure, every))
        outcome = Exploration(problem).run(250)
    assert outcome.verdict is not (Verdict.FOUND if corridor < 0.2 else Verdict.INFEASIBLE)


def moved_and_doubled(section: CrossSection, *others: CrossSection) -> CrossSection:
    """A result that is too large to be right: what was put in, moved and doubled."""
    return section + section.translate((50.0, 0.0))


BROKEN = [
    ("__xor__", raising),
    ("__xor__", moved_and_doubled),
    ("decompose", raising),
    ("decompose", lambda section: []),
]


@settings(max_examples=10)
@given(st.sampled_from(BROKEN), st.integers(1, 9), st.sampled_from((0.19, 0.3)))
def test_no_exploration_errs_however_often_regions_cannot_be_cut_or_parted(
    broken, every: int, corridor: float
) -> None:
    name, failure = broken
    works, calls = getattr(CrossSection, name), iter(range(1_000_000_000))
    problem = rod_problem(corridor)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            CrossSection, name, lambda *sections: (failure if next(calls) % every == 0 else works)(*sections)
        )
        outcome = Exploration(problem).run(200)
    assert outcome.verdict is not (Verdict.FOUND if corridor < 0.2 else Verdict.INFEASIBLE)
