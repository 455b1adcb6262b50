"""Plans are verified, by the command too, and altered ones refused; what the exact checker is asked."""

import json
from dataclasses import replace

import numpy as np
import pytest
from shapely import MultiPoint

from coop_drake.answers import save_plan
from coop_drake.answers.plan import other_age
from coop_drake.checking import plane
from coop_drake.checking.team import Question, swept
from coop_drake.errors import RefusalError
from coop_drake.planning.planner import plan as make
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.verification import verify_file
from coop_drake.verification.question import question_of, save_question
from tests.support.cases import case
from tests.support.certificates import GAINS, changed, room_with_pillar, write
from tests.support.cli import invoke
from tests.support.scenarios import write_scenario
from tests.support.trees import body_footprints

PROBLEM = room_with_pillar()


@pytest.fixture(scope="module")
def plan():
    return make(PROBLEM, GAINS["scheduled"], gain_set_name="scheduled").plan


@pytest.fixture(scope="module")
def document(plan, tmp_path_factory):
    path = save_plan(plan, tmp_path_factory.mktemp("plan") / "plan.json")
    return json.loads(path.read_text())


def test_a_plan_is_verified_and_says_what_was_checked(document, tmp_path):
    verified = verify_file(write(document, tmp_path / "plan.json", signed=False), PROBLEM, GAINS)
    assert (verified.answer, verified.subject) == ("found", f"plan of {len(document['cells'])} cells")
    assert all(check.count > 0 for check in verified.checks)


def test_the_plan_of_the_base_case_is_verified(tmp_path):
    problem = case("base")
    plan = make(problem, GAINS["scheduled"], gain_set_name="scheduled").plan
    path = save_plan(plan, tmp_path / "plan.json")
    counts = {check.name: check.count for check in verify_file(path, problem, GAINS).checks}
    pieces, cells = 7, len(plan.cells)
    assert counts["no piece meets a wall at any configuration of any cell"] == pieces * cells
    assert counts["no two pieces of a pair meet at any configuration of any cell"] == 14 * cells


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_a_plan_for_another_deployment_is_refused_with_both_ages_and_the_command(plan, factor, tmp_path):
    gains = {"scheduled": GAINS["scheduled"].for_age(0.0175)}
    gain = [replace(one.gains, rate_gain=one.gains.rate_gain / factor) for one in plan.transitions]
    slowed = tuple(replace(one, gains=own) for one, own in zip(plan.transitions, gain, strict=True))
    made = replace(plan, age_factor=factor, transitions=slowed)
    path = save_plan(made, tmp_path / "plan.json")
    with pytest.raises(RefusalError, match=r"15 ms old, .* these 17\.5 ms old; `coop-drake plan`"):
        verify_file(path, PROBLEM, gains)
    assert other_age(made, GAINS["scheduled"]) == other_age(made, None) == ""


def metres(values):
    return np.array(values, dtype=object) / plane.ONE


@pytest.fixture(autouse=True)
def enough_work():
    plane.work_left[0] = 10**9


@pytest.mark.parametrize("name", ["base", "elbow", "three"])
def test_bodies_are_where_the_tree_has_them(name):
    problem = case(name)
    asked = Question(question_of(problem))
    tree, random = problem.tree, np.random.default_rng(5)
    z = np.concatenate((random.uniform(-3.0, 3.0, 3), random.uniform(tree.joint_lower, tree.joint_upper)))
    (angles,) = [[(value, value) for value in plane.numbers(z[2:].tolist(), len(z) - 2)]]
    expected, found = body_footprints(tree, z), {}
    for piece in asked.pieces:
        points, error = swept(piece.corners, 0, piece.chain, angles)
        assert error < plane.ONE >> 60
        shape = MultiPoint((metres(points).astype(float) + z[:2]).tolist()).convex_hull
        found.setdefault(piece.body, []).append(shape.buffer(piece.radius / plane.ONE, quad_segs=64))
    names = {(i, j): b.name for i, c in enumerate(tree.components) for j, b in enumerate(c.bodies)}
    assert len(found) == len(names) == len(asked.pieces)
    for body, shape in expected.items():
        (piece,) = found[names[body]]
        assert shape.symmetric_difference(piece).area < 2e-3 * shape.area


def test_floor_start_goal_and_limits_are_the_problems(tmp_path):
    problem = case("base")
    asked = Question(json.loads(save_question(problem, tmp_path / "question.json").read_text()))
    assert sum(map(len, asked.floor.rings)) == 29
    start = [*asked.start, *[low for low, _ in asked.start_box]]
    goal = [*asked.goal, sum(asked.goal_box[0]) // 2]
    np.testing.assert_allclose(metres(start).astype(float), problem.start, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(metres(goal).astype(float), problem.goal_pose, rtol=0.0, atol=1e-15)
    room = [asked.room, (asked.goal_box[0][1] - asked.goal_box[0][0]) // 2]
    tolerances = [problem.position_tolerance, problem.angle_tolerance]
    np.testing.assert_allclose(metres(room).astype(float), tolerances, rtol=0.0, atol=1e-15)
    limits = np.stack((problem.tree.joint_lower, problem.tree.joint_upper), axis=1)
    np.testing.assert_allclose(metres(asked.limits).astype(float), limits, rtol=0.0, atol=1e-15)


def test_pairs_are_derived_by_the_checker_even_if_the_planner_forgets_them(monkeypatch):
    problem = case("base")
    monkeypatch.setattr(ComponentTree, "collision_pairs", ())
    question = question_of(problem)
    assert len(Question(question).pairs) == 14
    bodies = [piece["body"] for piece in question["pieces"]]
    assert [(bodies[i], bodies[j], reason) for i, j, reason in question["left_aside"]] == [
        ("robot_0::link_2", "robot_0::link_1", "joint"),
        ("robot_1::link_2", "robot_1::link_1", "joint"),
    ]


GAP = [[0, 0], [4, 0], [4, 1.8], [5, 1.8], [5, 0], [9, 0], [9, 4], [5, 4], [5, 2.2], [4, 2.2], [4, 4], [0, 4]]


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """An open room with its plan and a gap too narrow with its certificate."""
    folder = tmp_path_factory.mktemp("planned")
    room = write_scenario(folder / "room.scenario.yaml")
    gap = write_scenario(
        folder / "gap.scenario.yaml",
        workspace={"outer": GAP},
        start={"object": {"x": 2.0, "y": 2.0, "theta": 0.0}, "joints": {"robot_0": [0.0], "robot_1": [0.0]}},
        goal={"object": {"x": 7.0, "y": 2.0, "theta": 0.0}},
    )
    answers = [invoke("plan", path, "--out", folder / path.stem) for path in (room, gap)]
    assert [one.exit_code for one in answers] == [0, 3]
    assert "The proof is in" in answers[1].stdout
    written = sorted(path.name for path in (folder / gap.stem).iterdir())
    assert written == [".coop_drake_results.json", "certificate.json"]
    return (room, folder / "room.scenario" / "plan.json"), (gap, folder / "gap.scenario" / "certificate.json")


@pytest.mark.parametrize(("number", "answer"), [(0, "found"), (1, "infeasible")])
def test_both_answers_are_verified(planned, number, answer):
    scenario, file = planned[number]
    result = invoke("verify", file, scenario, "--json")
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    assert (facts["valid"], facts["answer"]) == (True, answer)
    assert {"name", "count", "tightest", "unit", "arrays"} == facts["checks"][0].keys()
    shown = invoke("verify", file, scenario)
    assert f"valid, {answer}: {facts['subject']}" in " ".join(shown.stdout.split())
    assert all(heading in shown.stdout for heading in ("checked", "times", "closest to refusal"))
    assert shown.stdout.splitlines()[-1] == f"Proved: {facts['proved']}. Not proved: {facts['not_proved']}"
    assert invoke("verify", file, scenario, "--quiet").output == ""


def test_refused_files_say_what_and_where(planned, tmp_path):
    scenario, file = planned[0]
    document = json.loads(file.read_text())
    altered = changed(document, ("transitions", 0, "neck"), document["transitions"][0]["neck"] + 1e-9)
    result = invoke("verify", write(altered, tmp_path / "plan.json", signed=False), scenario, "--json")
    assert result.exit_code == 1
    facts = json.loads(result.stdout)
    assert (facts["valid"], facts["where"]) == (False, "digest")
    assert "it was altered" in result.stderr
    other = invoke("verify", file, planned[1][0], "--json")
    assert other.exit_code == 1
    assert json.loads(other.stdout)["where"] == "start"
