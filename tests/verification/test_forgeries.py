"""Forgeries that once passed, for five scenarios: each is refused; honest answers of their kind hold."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.adversaries.collisions import Document
from benchmarks.adversaries.forgeries import forged_proof
from benchmarks.adversaries.questions import crossing_question
from benchmarks.adversaries.trial import answered, kind_of
from benchmarks.adversaries.trial import refusal as refused
from coop_drake.answers.digest import problem_digest
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import PlanError, RefusalError
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.verification import verify_file
from coop_drake.verification.question import question_of
from tests.support.cases import case
from tests.support.certificates import GAINS, changed, room_with_pillar, write

BLOCKED_GOALS = {
    "base": (4.25, 7.29, 0.26),
    "tight": (4.25, 7.29, 0.26),
    "three": (1.79, 0.73, -2.89),
    "elbow": (4.3, 3.1, -0.78),
    "pillar": (5.48, 4.11, -1.93),
}
"""Goals (x, y, theta) of each scenario that are blocked, but not in the same way at all angles of a joint."""

SCENARIOS = pytest.mark.parametrize("name", BLOCKED_GOALS)
CUTS = range(12)


@cache
def scenario(name: str) -> PlanningProblem:
    return room_with_pillar(2) if name == "pillar" else case(name)


@cache
def plan_of(name: str) -> Document:
    documents = answered(scenario(name))
    assert documents is not None
    assert kind_of(documents[1]) == "plan"
    return documents[1]


def refusal(document: Document, problem: PlanningProblem, folder: Path) -> str:
    """Why ``verify`` refuses a document whose digests are right; empty if it accepts it."""
    own = {**document, "problem": problem_digest(problem)}
    try:
        verify_file(write(own, folder / "answer.json", signed=True), problem, GAINS)
    except (RefusalError, PlanError) as error:
        return str(error)
    return ""


@SCENARIOS
def test_two_cells_on_either_side_of_a_cut_do_not_part_a_floor_that_has_a_way(name, tmp_path) -> None:
    """Gaps from nothing, or a unit in the last place, to a tenth of a millimetre."""
    question = question_of(scenario(name))
    for seed in CUTS:
        proof = forged_proof(question, seed)
        assert proof is not None
        said = refusal(proof, scenario(name), tmp_path)
        assert "no cell covers" in said or "which has another label" in said, seed


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
    assert finding in refused(question, proof)
    assert refusal(proof, scenario(name), tmp_path)


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("name", ["base", "pillar"])
def test_honest_proofs_that_a_goal_is_blocked_hold_with_several_slices(name, tmp_path) -> None:
    problem = replace(scenario(name), goal_pose=np.array(BLOCKED_GOALS[name]))
    documents = answered(problem)
    assert documents is not None
    assert kind_of(documents[1]) == "blocked goal"
    assert len(documents[1]["slices"]) > 1
    assert refusal(documents[1], problem, tmp_path) == ""


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
            assert key in refusal(altered, scenario(name), tmp_path)
    narrow = deepcopy(plan)
    step = narrow["transitions"][0]
    step["goal_upper"] = np.nextafter(step["goal_lower"], np.inf).tolist()
    assert "too near" in refusal(narrow, scenario(name), tmp_path)


@pytest.mark.parametrize("seed", range(5))
def test_a_planner_that_forgets_all_pairs_of_bodies_is_found_out(seed, tmp_path, monkeypatch) -> None:
    problem = crossing_question(seed, crossed="start")
    with monkeypatch.context() as forgetful:
        forgetful.setattr(ComponentTree, "collision_pairs", ())
        documents = answered(problem)
    assert documents is not None
    assert kind_of(documents[1]) == "plan"
    said = refusal(documents[1], problem, tmp_path)
    assert " may touch " in said
    assert "a wall" not in said
