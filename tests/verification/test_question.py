"""The question that the exact checker is asked: the same team, floor, start and goal, and all pairs."""

import json

import numpy as np
import pytest
from shapely import MultiPoint

from coop_drake.checking import plane
from coop_drake.checking.team import Question, swept
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.verification.question import question_of, save_question
from tests.support.cases import case
from tests.support.trees import body_footprints


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
