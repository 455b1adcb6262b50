"""Proofs of infeasibility are verified; altered and forged ones are refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import Polygon

from coop_drake.answers.document import Document, problem_digest
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import read_proof, save_proof
from coop_drake.errors import PlanError, RefusalError
from coop_drake.planning import find_channel
from coop_drake.planning.cells.exploration import Exploration
from coop_drake.planning.certificates import Witnesses, slices_proof
from coop_drake.planning.questions import relaxed
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape
from coop_drake.verification import verify_file, verify_proof
from tests.support.certificates import (
    GAINS,
    bent_corridor,
    changed,
    entry_at,
    write,
)

PROBLEM = bent_corridor(0.58)
AT_GOAL = bent_corridor(1.2, goal=(5.6, 5.0, 0.1))
KINDS = {"slices": PROBLEM, "blocked goal": AT_GOAL}


def proof_of(problem):
    answer, _ = find_channel(problem)
    return answer.proof


@pytest.fixture(scope="module")
def proofs():
    return {kind: proof_of(problem) for kind, problem in KINDS.items()}


@pytest.fixture(scope="module")
def documents(proofs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("proofs")
    paths = {kind: save_proof(proofs[kind], KINDS[kind], folder / kind) for kind in KINDS}
    return {kind: json.loads(path.read_text()) for kind, path in paths.items()}


def refusal(document, tmp_path, problem, *, signed=True):
    """What a document is refused for, None where it is verified."""
    try:
        verify_file(write(document, tmp_path / "certificate.json", signed=signed), problem, GAINS)
    except (RefusalError, PlanError) as error:
        return str(error)
    return None


@pytest.mark.parametrize("kind", KINDS)
def test_proofs_are_stated_saved_and_verified(proofs, documents, tmp_path, kind):
    assert proofs[kind].kind == kind
    path = save_proof(proofs[kind], KINDS[kind], tmp_path / "certificate.json")
    again = save_proof(read_proof(Document.load(path, "a proof")).proof, KINDS[kind], tmp_path / "again.json")
    assert again.read_bytes() == path.read_bytes()
    verified = verify_file(path, KINDS[kind], GAINS)
    assert verified.answer == "infeasible"
    assert all(check.count > 0 for check in verified.checks)
    way = ("slices", 0, "upper", 0)
    altered = changed(documents[kind], way, float(np.nextafter(entry_at(documents[kind], way), np.inf)))
    assert "it was altered" in refusal(altered, tmp_path, KINDS[kind], signed=False)


def test_a_proof_about_one_floor_does_not_hold_on_a_wider_one(documents, tmp_path):
    wider = bent_corridor(0.9)
    assert "problem: " in refusal(documents["slices"], tmp_path, wider)
    forged = {**documents["slices"], "problem": problem_digest(wider)}
    assert "no cell covers" in refusal(forged, tmp_path, wider)


def test_a_cut_through_free_space_is_refused():
    """Where there is a way, no choice of labels makes a proof: over-cells of an unfinished exploration."""
    feasible = bent_corridor(1.2)
    question, _ = relaxed(feasible, ())
    exploration = Exploration(question)
    exploration.run(24)
    witnesses = Witnesses(feasible.tree, exploration.swept)
    leaves = exploration.over_leaves()
    assert slices_proof(question, exploration.slices, leaves, witnesses) is None
    far = replace(question, goal_pose=np.array([50.0, 50.0, 0.0]))
    stated = slices_proof(far, exploration.slices, leaves, witnesses)
    with pytest.raises(RefusalError, match="cells may hold the goal and have reached: True"):
        verify_proof(stated, feasible)
    unlabelled = replace(stated, slices=tuple(without_label(part, feasible) for part in stated.slices))
    with pytest.raises(RefusalError, match=r"touches|may hold the start and have reached: False"):
        verify_proof(unlabelled, feasible)


def without_label(part, problem):
    """A slice whose cells about the goal are called not reached."""
    goal = shapely.Point(problem.goal_pose[:2])
    labels = [cell.reached and not cell.polygon.covers(goal) for cell in part.cells]
    cells = tuple(replace(cell, reached=label) for cell, label in zip(part.cells, labels, strict=True))
    return replace(part, cells=cells)


@pytest.mark.parametrize(
    ("kind", "way", "value", "message"),
    [
        ("slices", ("component",), 2, r"index: 2 is none below 2"),
        ("slices", ("component",), 1, r"may leave the inside of"),
        ("slices", ("slices", 0, "lower", 1), -1.0, r"slices: do not tile|may leave"),
        ("slices", ("format",), "song", r"format: 'song' is not allowed; expected 'coop_drake plan'"),
        ("slices", ("slices", 0, "lower", 0), 9.0, r"slices\[0\].upper\[0\]: .* 9.0 or more"),
        ("slices", ("point", 1), 0.01, r"witnesses: may leave the inside of"),
        ("blocked goal", ("slices", 0, "upper", 0), 0.2, r"slices: do not tile"),
    ],
)
def test_refusals_under_a_new_digest_say_what_and_where(documents, tmp_path, kind, way, value, message):
    document = changed(documents[kind], way, value)
    with pytest.raises((RefusalError, PlanError), match=message):
        verify_file(write(document, tmp_path / "certificate.json", signed=True), KINDS[kind], GAINS)


def test_a_blocked_goal_is_proved_by_slices_about_it_that_may_be_halved(proofs):
    proof = proofs["blocked goal"]
    (part,) = [part for part in proof.slices if any(cell.polygon.interiors for cell in part.cells)]
    rest = [other for other in proof.slices if other is not part]
    below, above = part.upper.copy(), part.lower.copy()
    below[1] = above[1] = 0.2
    halved = (replace(part, upper=below), replace(part, lower=above))
    verified = verify_proof(replace(proof, slices=(*rest, *halved)), AT_GOAL)
    assert verified.checks[0].count == len(proof.slices) + 1
    with pytest.raises(RefusalError, match="slices: do not tile their range"):
        verify_proof(replace(proof, slices=(*rest, halved[0])), AT_GOAL)


def test_a_goal_is_not_blocked_where_the_team_fits(proofs):
    fits = bent_corridor(1.2)
    with pytest.raises(RefusalError, match=r"cells may hold the goal and have reached: True"):
        verify_proof(proofs["blocked goal"], fits)


def object_alone(shapes, floor, start, goal):
    component = Component("object", None, None, (Body("object", None, shapes),))
    tree = ComponentTree((component,), frozenset())
    return PlanningProblem(floor, tree, np.array(start), np.array(goal), ())


def test_a_gap_that_closes_but_for_a_hair_belongs_to_a_cell_of_the_proof():
    """Between the tips of two thin walls the polygons of the proof pass, those of the exploration do not."""
    corners = np.array([[-0.3487, -0.2748], [0.2782, -0.1792], [-0.1691, 0.1523]])
    walls = [
        (8.13504, -1.12725), (4.72621, -0.67707), (5.04624, 1.74625), (5.04621, 1.74625), (4.72618, -0.67707),
        (3.25109, -0.48226), (3.39017, 0.57091), (3.51988, 0.76344), (3.41056, 0.7253), (3.73178, 3.15767),
        (5.20688, 2.96287), (5.15115, 2.54086), (5.15117, 2.54086), (5.2069, 2.96287), (8.61574, 2.51269),
    ]  # fmt: skip
    shape = ConvexShape(corners, 0.2057)
    problem = object_alone((shape,), Polygon(walls), (4.4, 1.63, 1.0), (7.2, 0.83, 0.95))
    assert verify_proof(proof_of(problem), problem)


def test_a_goal_on_a_slanted_wall_is_blocked_where_one_piece_is_off_the_floor():
    disc, capsule = ConvexShape(np.array([[-0.34, -0.17]]), 0.11), ConvexShape(np.array([[0.07, 0.3]]), 0.14)
    floor = Polygon([(0, 0), (4, 1), (3, 5), (-1, 4)])
    problem = object_alone((disc, capsule), floor, (2.0, 2.0, 0.0), (2.0, 0.5, 0.4))
    proof = proof_of(problem)
    assert proof.kind == "blocked goal"
    assert verify_proof(proof, problem)


@pytest.mark.slow
@pytest.mark.parametrize("beyond", [0.0, 1e-9, -1e-9])
def test_a_goal_of_which_one_point_touches_a_wall_and_no_other_is_free_is_undecided(beyond):
    """Within its tolerance of 0.01 m the goal reaches to a touch, up to rounding."""
    square = ConvexShape(np.array([[-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]]))
    problem = object_alone((square,), shapely.box(0, 0, 4, 3), (1.0, 1.0, 0.0), (3.81 + beyond, 1.5, 0.0))
    answer, _ = find_channel(problem)
    assert not answer.proved
    assert "object all but touches a wall" in answer.reason
