"""Explorations: their channels, their cheapest paths, their events, and searches by cells alone."""

from itertools import pairwise

import networkx as nx
import numpy as np
import pytest

from coop_drake.answers.problem import PlannerSettings
from coop_drake.planning.cells.exploration import (
    ChannelSearched,
    Event,
    Exploration,
    ExplorationBegan,
    ExplorationEnded,
    ExplorationResult,
    SliceAdded,
    SliceSplit,
    Verdict,
)
from coop_drake.planning.cells.graph import CellGraph, Kind
from coop_drake.planning.channel import Channel, NoChannel, make_channel
from coop_drake.planning.questions import relaxed
from coop_drake.planning.search import find_channel
from tests.planning.test_search import rod_problem
from tests.support.cases import case
from tests.support.soundness import assert_channel_is_sound

# Paths moved to the middle of their narrowest passages, and the distances that this is computed from.


def test_exploration_alone_finds_a_sound_channel() -> None:
    problem = rod_problem(0.5)
    exploration = Exploration(problem)
    outcome = exploration.run(2000)
    assert outcome.verdict is Verdict.FOUND
    assert all(cell.kind is Kind.FREE for cell in outcome.path)
    for one, other in pairwise(outcome.path):
        assert other.slice in exploration.slices.all[one.slice].neighbours
        assert one.region.meets(other.region)
    channel = make_channel(problem, exploration.boxes(outcome.path), 0.0, None)
    assert_channel_is_sound(problem, channel)


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


@pytest.mark.parametrize("budget", [20, 60, 100])
def test_a_search_that_goes_on_finds_the_path_of_a_new_one(budget: int) -> None:
    exploration = Exploration(relaxed(case("closed"), (1,))[0])
    path, graph = exploration.run(budget).path, CellGraph(exploration.slices)
    leaves = sorted(
        (cells[0].index, leaf, cells) for leaf, cells in exploration.graph.by_slice.items() if cells
    )
    for _, leaf, cells in leaves:
        graph.add(leaf, [(cell.kind, cell.region, cell.weight) for cell in cells])
    ends = [
        [graph.by_slice[leaf][i] for _, leaf, cells in leaves for i, cell in enumerate(cells) if cell in its]
        for its in (
            [cell for cells in exploration._starts.values() for cell in cells],
            [exploration.graph.cells[k] for cells in exploration._goals.values() for k in cells],
        )
    ]
    again = graph.cheapest(ends[0], {cell.index for cell in ends[1]})
    assert len(path) > 3
    assert [cell.region for cell in again] == [cell.region for cell in path]


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


# Paths moved to the middle of their narrowest passages, and the distances that this is computed from.


def watched(corridor: float, budget: int) -> tuple[list[Event], ExplorationResult, Exploration]:
    problem, events = rod_problem(corridor), []
    exploration = Exploration(problem, watch=events.append)
    return events, exploration.run(budget), exploration


def test_events_replay_the_subdivision() -> None:
    events, outcome, exploration = watched(0.3, 500)
    assert isinstance(events[0], ExplorationBegan)
    leaves = set()
    for event in events:
        if isinstance(event, SliceAdded):
            leaves.add(event.slice)
            assert event.intervals == exploration.slices.all[event.slice].intervals
            assert {cell.slice for cell in event.cells} <= {event.slice}
        elif isinstance(event, SliceSplit):
            leaves.remove(event.slice)
            assert exploration.slices.all[event.slice].halves is not None
    assert leaves == set(exploration.slices.leaves())
    assert sum(isinstance(event, SliceAdded) for event in events) == outcome.slices


def test_the_last_events_are_the_channel_and_the_verdict() -> None:
    for corridor in (0.3, 0.19):
        events, outcome, _ = watched(corridor, 500)
        channel, ended = events[-2:]
        assert isinstance(channel, ChannelSearched)
        assert isinstance(ended, ExplorationEnded)
        assert [cell.region for cell in channel.cells] == [cell.region for cell in outcome.path]
        assert (ended.verdict, ended.slices) == (outcome.verdict.value, outcome.slices)


def test_watching_changes_nothing() -> None:
    problem = rod_problem(0.3)
    alone = Exploration(problem)
    _, outcome, _ = watched(0.3, 500)
    assert alone.run(500).slices == outcome.slices


# Explorations by cells alone: same answers, sound channels, proofs that can be checked again.


@pytest.mark.parametrize(("strategy", "margin"), [("cells", 0.1), ("paper", 0.0)])
def test_a_channel_is_found_and_sound(strategy: str, margin: float) -> None:
    problem = rod_problem(0.5, PlannerSettings(strategy=strategy))
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert channel.margin == margin
    assert_channel_is_sound(problem, channel)


@pytest.mark.parametrize("strategy", ["cells", "paper"])
def test_a_corridor_narrower_than_the_rod_is_refuted(strategy: str) -> None:
    answer, _ = find_channel(rod_problem(0.19, PlannerSettings(strategy=strategy)))
    assert isinstance(answer, NoChannel)
    assert answer.proved
    assert answer.proof is not None
    assert answer.proof.kind == "slices"


@pytest.mark.parametrize("strategy", ["cells", "paper"])
def test_undecided_says_what_remained_mixed(strategy: str) -> None:
    answer, _ = find_channel(rod_problem(0.203, PlannerSettings(strategy=strategy, max_slices=8)))
    assert isinstance(answer, NoChannel)
    assert not answer.proved
    assert answer.mixed
    assert answer.mixed[0].width_fraction == max(cell.width_fraction for cell in answer.mixed)


def test_cells_alone_refute_in_the_full_space() -> None:
    answer, report = find_channel(case("closed", PlannerSettings(strategy="cells")))
    assert isinstance(answer, NoChannel)
    assert answer.proved
    assert report.slices < 400


@pytest.mark.parametrize("strategy", ["cells", "paper"])
def test_whoever_watches_is_told(strategy: str) -> None:
    events: list[Event] = []
    find_channel(rod_problem(0.19, PlannerSettings(strategy=strategy)), watch=events.append)
    assert isinstance(events[0], ExplorationBegan)
    assert isinstance(events[-2], ChannelSearched)
