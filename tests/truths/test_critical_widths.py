"""Passages whose critical width is known exactly: found above it, refuted below it."""

import pytest

from coop_drake.answers.problem import PlannerSettings
from coop_drake.planning.channel import Channel
from coop_drake.planning.search import find_channel
from tests.support.passages import DiscDoor, FoldingArm, LadderCorner, RodCorridor
from tests.support.soundness import assert_channel_is_sound

pytestmark = pytest.mark.slow

PASSAGES = (DiscDoor(), RodCorridor(), LadderCorner(), FoldingArm())
NAMES = [type(passage).__name__ for passage in PASSAGES]
EPS = 0.003
"""With the settings that a user gets, no width further than this from the critical one is undecided [m]."""


@pytest.mark.parametrize("passage", PASSAGES, ids=NAMES)
def test_just_above_the_critical_width_a_channel_is_found(passage) -> None:
    problem = passage.problem(passage.critical + EPS)
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(problem, channel, samples=12)


@pytest.mark.parametrize("passage", PASSAGES, ids=NAMES)
def test_just_below_the_critical_width_the_answer_is_a_proof(passage) -> None:
    answer, _ = find_channel(passage.problem(passage.critical - EPS))
    assert not isinstance(answer, Channel)
    assert answer.proved


@pytest.mark.parametrize("offset", [0.0, 1e-4])
@pytest.mark.parametrize("passage", PASSAGES[:3], ids=NAMES[:3])
def test_near_the_critical_width_no_answer_is_wrong(passage, offset: float) -> None:
    """A body as wide as its passage touches the walls all along: at the critical width itself, no."""
    problem = passage.problem(passage.critical + offset, PlannerSettings(max_slices=64))
    answer, _ = find_channel(problem)
    if isinstance(answer, Channel):
        assert offset > 0.0
        assert_channel_is_sound(problem, answer, samples=12)
    else:
        assert offset <= 0.0 or not answer.proved
