from coop_drake.planning.cells.exploration import (
    ChannelSearched,
    Event,
    Exploration,
    ExplorationBegan,
    ExplorationEnded,
    ExplorationResult,
    SliceAdded,
    SliceSplit,
)
from tests.planning.test_search import rod_problem


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
