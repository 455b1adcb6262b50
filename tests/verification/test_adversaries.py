"""Altered, forged or at the edge of what can be written: no false answer is accepted, and true ones are."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.adversaries.collisions import Document
from benchmarks.adversaries.forgeries import forged_proof
from benchmarks.adversaries.questions import crossing_question
from benchmarks.adversaries.trial import answered, judged, kind_of, refusal
from coop_drake.answers.document import problem_digest
from coop_drake.answers.problem import PlanningProblem
from coop_drake.checking.__main__ import main
from coop_drake.errors import PlanError, RefusalError
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.verification import verify_file
from coop_drake.verification.question import question_of
from tests.planning.test_search import reaching
from tests.support.cases import case
from tests.support.certificates import GAINS, bent_corridor, changed, room_with_pillar, write
from tests.support.moved import Similarity

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


BLOCKED_GOALS = {
    "base": (4.25, 7.29, 0.26),
    "tight": (4.25, 7.29, 0.26),
    "three": (1.79, 0.73, -2.89),
    "elbow": (4.3, 3.1, -0.78),
    "pillar": (5.48, 4.11, -1.93),
}
"""Goals (x, y, theta) of each scenario that are blocked, but not in the same way at all angles of a joint."""

SCENARIOS = pytest.mark.parametrize("name", BLOCKED_GOALS)


@cache
def scenario(name: str) -> PlanningProblem:
    return room_with_pillar(2) if name == "pillar" else case(name)


@cache
def plan_of(name: str) -> Document:
    documents = answered(scenario(name))
    assert documents is not None
    assert kind_of(documents[1]) == "plan"
    return documents[1]


def verify_refusal(document: Document, problem: PlanningProblem, folder: Path) -> str:
    """Why ``verify`` refuses a document whose digests are right; empty if it accepts it."""
    own = {**document, "problem": problem_digest(problem)}
    try:
        verify_file(write(own, folder / "answer.json", signed=True), problem, GAINS)
    except (RefusalError, PlanError) as error:
        return str(error)
    return ""


@SCENARIOS
@pytest.mark.parametrize(("reach", "finding"), [(1e21, "2^20"), (1e25, "2^20"), (1e6, "no cell covers")])
def test_a_gap_of_a_metre_between_cells_that_reach_far_away_is_seen(name, reach, finding, tmp_path) -> None:
    question = question_of(scenario(name))
    proof = forged_proof(question, 0)
    assert proof is not None
    ahead = np.array(question["goal"]) - np.array(question["start"][:2])
    ahead /= np.hypot(*ahead)
    for cell, side in zip(proof["slices"][0]["cells"], (-1.0, 1.0), strict=True):
        ring = np.array(cell["polygon"]["outer"]) + 0.495 * side * ahead
        ring[2:] += side * reach * ahead
        cell["polygon"]["outer"] = ring.tolist()
    assert finding in refusal(question, proof)
    assert verify_refusal(proof, scenario(name), tmp_path)


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("name", ["base", "pillar"])
def test_honest_proofs_that_a_goal_is_blocked_hold_with_several_slices(name, tmp_path) -> None:
    problem = replace(scenario(name), goal_pose=np.array(BLOCKED_GOALS[name]))
    documents = answered(problem)
    assert documents is not None
    assert kind_of(documents[1]) == "blocked goal"
    assert len(documents[1]["slices"]) > 1
    assert verify_refusal(documents[1], problem, tmp_path) == ""


@pytest.mark.slow
@pytest.mark.no_cover
@SCENARIOS
def test_figures_and_goal_intervals_mean_what_is_executed(name, tmp_path) -> None:
    """A neck, an inradius or a length of a kilometre; a goal interval of one unit in the last place."""
    plan = plan_of(name)
    for key in ("neck", "inradius", "length"):
        stated = plan["transitions"][0][key]
        for value in (1000.0, stated * (1.0 + 1e-6)):
            altered = changed(plan, ("transitions", 0, key), value)
            assert key in verify_refusal(altered, scenario(name), tmp_path)
    narrow = deepcopy(plan)
    step = narrow["transitions"][0]
    step["goal_upper"] = np.nextafter(step["goal_lower"], np.inf).tolist()
    assert "too near" in verify_refusal(narrow, scenario(name), tmp_path)


@pytest.mark.parametrize("seed", range(5))
def test_a_planner_that_forgets_all_pairs_of_bodies_is_found_out(seed, tmp_path, monkeypatch) -> None:
    problem = crossing_question(seed, crossed="start")
    with monkeypatch.context() as forgetful:
        forgetful.setattr(ComponentTree, "collision_pairs", ())
        documents = answered(problem)
    assert documents is not None
    assert kind_of(documents[1]) == "plan"
    said = verify_refusal(documents[1], problem, tmp_path)
    assert " may touch " in said
    assert "a wall" not in said


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
