"""Whatever is altered, no false answer is accepted, and true ones are."""

from __future__ import annotations

from copy import deepcopy

import pytest

from benchmarks.adversaries.trial import answered, judged, refusal
from tests.support.certificates import bent_corridor, room_with_pillar

pytestmark = pytest.mark.no_cover  # other tests run the same lines, and measuring takes as long again

ANSWERS = {
    "plan": room_with_pillar,
    "slices": lambda: bent_corridor(0.58),
    "blocked goal": lambda: bent_corridor(1.2, goal=(5.6, 5.0, 0.1)),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ANSWERS)
def test_alterations_are_refused_where_they_are_false_and_accepted_where_they_are_true(kind: str) -> None:
    documents = answered(ANSWERS[kind]())
    assert documents is not None
    assert documents[1].get("kind", "plan") == kind
    found = list(judged(*documents, range(3 if kind == "blocked goal" else 1)))
    assert [one for one in found if one.wrong] == []
    truths = [one.truth.split(":")[0] for one in found]
    assert truths.count("false") > 5
    assert truths.count("true") >= 2


def test_pairs_of_bodies_cannot_be_left_aside_for_a_joint_that_they_do_not_share() -> None:
    documents = answered(room_with_pillar(2))
    assert documents is not None
    question, answer = deepcopy(documents[0]), documents[1]
    arms = [k for k, piece in enumerate(question["pieces"]) if piece["component"] > 0]
    question["left_aside"].append([*arms[:2], "joint"])
    assert "share no joint" in refusal(question, answer)
