"""Explorations by cells alone: same answers, sound channels, proofs that can be checked again."""

import pytest

from coop_drake.answers.problem import PlannerSettings
from coop_drake.planning.cells.exploration import ChannelSearched, Event, ExplorationBegan
from coop_drake.planning.channel import Channel, NoChannel
from coop_drake.planning.search import find_channel
from tests.planning.test_search import rod_problem
from tests.support.cases import case
from tests.support.soundness import assert_channel_is_sound


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
