"""Documents at the edge of what can be written down: decided or refused, never an internal error."""

from __future__ import annotations

import json
import math
from copy import deepcopy
from functools import cache

import numpy as np
import pytest
from shapely import Polygon

from benchmarks.adversaries.collisions import Document
from benchmarks.adversaries.trial import answered, refusal
from coop_drake.checking.__main__ import main
from tests.planning.test_degenerate_input import CLOSED_FLOORS, OPEN_FLOORS, question
from tests.planning.test_questions import reaching
from tests.support.certificates import bent_corridor, changed, room_with_pillar
from tests.support.moved import Similarity

pytestmark = pytest.mark.no_cover  # other tests run the same lines, and measuring takes as long again

VALUES = (
    math.nan,
    math.inf,
    -math.inf,
    1e25,
    -1e300,
    10**400,
    -(10**30),
    True,
    None,
    "1",
    [],
    {},
    [[]],
    0.5,
    -1,
)
ODD_FLOORS = {name: floor for name, floor in (OPEN_FLOORS | CLOSED_FLOORS).items() if not floor.is_empty}
QUESTIONS = {"plan": room_with_pillar, "slices": lambda: bent_corridor(0.45)}


@cache
def documents(kind: str) -> tuple[Document, Document]:
    found = answered(QUESTIONS[kind]())
    assert found is not None
    return found


def places(value: object, way: tuple = ()) -> list[tuple]:
    """Ways to every value of a document, mappings and lists too."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [way, *[place for key, entry in inside for place in places(entry, (*way, key))]]


@pytest.mark.parametrize("kind", QUESTIONS)
@pytest.mark.parametrize("part", [0, 1])
def test_any_value_anywhere_is_decided_or_refused(kind: str, part: int) -> None:
    """A refusal is the only exception that may come."""
    sound = documents(kind)
    ways = [way for way in places(sound[part]) if way]
    random = np.random.default_rng(part)
    refused = 0
    for k in random.permutation(len(ways))[:40].tolist():
        pair = list(sound)
        pair[part] = changed(sound[part], ways[k], VALUES[k % len(VALUES)])
        refused += bool(refusal(*pair))
    assert refused > 12


@pytest.mark.parametrize(
    "text", ["[" * 200_000, "", "{}", "[1, 2", '{"question": 1, "answer": 2}', "\u0000", "1" * 9000]
)
def test_texts_that_are_no_documents_have_an_exit_code(tmp_path, text: str, capsys) -> None:
    path = tmp_path / "both.json"
    path.write_text(text)
    assert main([str(path)]) in (1, 2)
    said = capsys.readouterr()
    assert "refused" in said.out or "expected a question and an answer" in said.err


def test_a_floor_of_very_many_corners_is_decided_or_called_too_much_work() -> None:
    ask, answer = deepcopy(documents("plan")[0]), documents("plan")[1]
    turn = np.linspace(0.0, 2.0 * np.pi, 30_000, endpoint=False)
    ring = np.column_stack((3.0 + 20.0 * np.cos(turn), 2.5 + 20.0 * np.sin(turn)))
    ask["floor"]["outer"] = ring.tolist()
    refused = refusal(ask, answer)
    assert not refused or "more steps are needed than" in refused


@pytest.mark.parametrize("floor", ODD_FLOORS.values(), ids=ODD_FLOORS)
def test_answers_on_odd_floors_hold(floor: Polygon) -> None:
    """Slivers, hair-thin walls, rings that touch each other or lie outside: answers can be checked."""
    found = answered(question(floor))
    assert found is not None
    assert refusal(*found) == ""


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (1e6, -1e6)])
@pytest.mark.parametrize("start", [0.0, 0.5])
def test_joints_at_limits_far_from_the_origin_are_checked(
    kind, shift: tuple[float, float], start: float
) -> None:
    problem = Similarity(angle=3.1, shift=shift, mirror=True).question(reaching(start, (-0.5, 0.5), kind))
    found = answered(problem)
    assert found is not None
    assert refusal(*found) == ""


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_proofs_of_small_and_large_teams_hold(scale: float) -> None:
    found = answered(Similarity(scale=scale).question(bent_corridor(0.45)))
    assert found is not None
    assert found[1]["kind"] == "slices"
    assert refusal(*found) == ""


def test_whole_documents_are_read_from_files(tmp_path, capsys) -> None:
    ask, answer = documents("plan")
    path = tmp_path / "both.json"
    path.write_text(json.dumps({"question": ask, "answer": answer}))
    assert main([str(path)]) == 0
    assert capsys.readouterr().out.endswith("the answer holds\n")
