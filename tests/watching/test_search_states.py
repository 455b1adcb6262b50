"""States are the exploration itself, step by step, only merged."""

from __future__ import annotations

from itertools import pairwise

import pytest

from coop_drake.planning.cells.exploration import (
    ChannelSearched,
    Exploration,
    ExplorationBegan,
    ExplorationEnded,
    ExplorationResumed,
    SliceAdded,
    SliceSplit,
)
from coop_drake.planning.cells.graph import Kind
from coop_drake.watching import search_states
from tests.planning.test_search import rod_problem
from tests.watching.rods import NARROW, WIDE, rod_recording


@pytest.mark.parametrize("corridor", [WIDE, NARROW])
def test_events_replayed_give_the_leaves_cells_and_channel_of_the_exploration(corridor):
    problem, events = rod_problem(corridor), []
    exploration = Exploration(problem, watch=events.append)
    outcome = exploration.run(500)
    last = search_states(events, 7)[-1]
    assert sorted(last.leaves) == exploration.slices.leaves()
    for index, leaf in last.leaves.items():
        assert leaf.intervals == exploration.slices.all[index].intervals
        assert [cell.region for cell in leaf.cells] == [
            cell.region for cell in exploration.graph.by_slice[index]
        ]
    cells = [cell for leaf in last.leaves for cell in exploration.graph.by_slice[leaf]]
    for kind in (Kind.FREE, Kind.MIXED):
        assert last.count(kind) == sum(cell.kind is kind for cell in cells)
    assert [cell.region for cell in last.channel] == [cell.region for cell in outcome.path]
    assert last.cost == sum(cell.weight for cell in outcome.path)
    assert (last.slices, last.verdict) == (outcome.slices, outcome.verdict.value)


@pytest.mark.parametrize("most", [2, 3, 10, 10_000])
def test_no_more_states_than_asked_for_the_last_one_the_verdict_no_split_lost(most):
    recorded = rod_recording().events
    found = search_states(recorded, most)
    assert 2 <= len(found) <= most
    assert found[-1].verdict == "found"
    assert all(state.verdict is None for state in found[:-1])
    slices = [state.slices for state in found]
    assert slices == sorted(slices)
    halved = [(event.slice, event.axis) for event in recorded if isinstance(event, SliceSplit)]
    assert [(leaf.slice, axis) for state in found for leaf, axis in state.splits] == halved
    assert len(found[-1].history) == sum(isinstance(event, ChannelSearched) for event in recorded)


def test_states_lie_evenly_over_the_steps():
    recorded = rod_recording().events
    every = search_states(recorded, 10_000)
    few = search_states(recorded, 6)
    steps = [[state.slices for state in every].index(state.slices) for state in few]
    gaps = [second - first for first, second in pairwise(steps)]
    assert max(gaps) - min(gaps) <= 3


def test_a_single_keyframe_is_refused():
    with pytest.raises(ValueError, match="2 keyframes or more, got 1"):
        search_states(rod_recording().events, 1)


def test_explorations_that_take_turns_are_kept_apart():
    events = [
        ExplorationBegan("first", (0,)),
        SliceAdded(0, ((0.0, 1.0),), ()),
        ExplorationEnded("budget spent", 1),
        ExplorationBegan("second", ()),
        SliceAdded(0, ((2.0, 3.0),), ()),
        ExplorationEnded("budget spent", 1),
        ExplorationResumed("first"),
        SliceSplit(0, 0),
        SliceAdded(1, ((0.0, 0.5),), ()),
        SliceAdded(2, ((0.5, 1.0),), ()),
        ExplorationEnded("infeasible", 3),
    ]
    found = search_states(events, 50)
    assert [state.question for state in found] == [*["first"] * 2, *["second"] * 2, *["first"] * 2]
    middle = next(state for state in reversed(found) if state.question == "second")
    assert {leaf.intervals for leaf in middle.leaves.values()} == {((2.0, 3.0),)}
    assert (middle.robots, middle.verdict) == ((), "budget spent")
    last = found[-1]
    assert (last.question, last.robots, last.slices, last.verdict) == ("first", (0,), 3, "infeasible")
    assert sorted(last.leaves) == [1, 2]
    assert [state.question for state in search_states(events, 3)] == ["first", "second", "first"]
