"""Whatever is altered, no false answer is accepted, and true ones are."""

from __future__ import annotations

from copy import deepcopy

import numpy as np
import pytest
from shapely import box

from benchmarks.adversaries.questions import random_question
from benchmarks.adversaries.trial import answered, forged, judged, refusal
from coop_drake.answers.plan import Found
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from coop_drake.tree.component_tree import Body, Component, ComponentTree, TreeJoint
from coop_drake.tree.pose import PlanarPose
from coop_drake.verification import verify_plan
from tests.support.cases import case, rectangle
from tests.support.certificates import GAINS, bent_corridor, room_with_pillar

ANSWERS = {
    "plan": room_with_pillar,
    "slices": lambda: bent_corridor(0.62),
    "disc": lambda: bent_corridor(0.45),
    "blocked goal": lambda: bent_corridor(1.2, goal=(5.6, 5.0, 0.1)),
}
CROSSABLE = {
    "pillar": room_with_pillar,
    "two robots": lambda: room_with_pillar(2),
    "base": lambda: case("base"),
    "wide corridor": lambda: bent_corridor(1.2),
    "random": lambda: random_question(0),
}


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


@pytest.mark.parametrize("name", CROSSABLE)
def test_a_cut_through_a_floor_that_has_a_way_proves_nothing(name: str) -> None:
    documents = answered(CROSSABLE[name]())
    assert documents is not None
    assert "kind" not in documents[1]
    found = list(forged(documents[0], range(6)))
    assert len(found) == 6
    assert all(one.refusal for one in found)


def crossing_arms() -> PlanningProblem:
    """An object with two arms that cross at the start."""
    arms = []
    for k, side in enumerate((1.0, -1.0)):
        joint = TreeJoint(
            f"joint_{k}", "revolute", k, k, PlanarPose(0.2, 0.15 * side), 1.0, (1.0, 0.0), -1.0, 1.0
        )
        arms.append(
            Component(f"arm_{k}", 0, joint, (Body(f"arm_{k}", k, (rectangle(0.0, 0.6, -0.03, 0.03),)),))
        )
    bar = Component("bar", None, None, (Body("bar", None, (rectangle(-0.2, 0.2, -0.2, 0.2),)),))
    tree = ComponentTree((bar, *arms), frozenset({("arm_0", "bar"), ("arm_1", "bar")}))
    start = np.array([1.0, 1.0, 0.0, -0.5, 0.5])
    return PlanningProblem(box(0, 0, 5, 4), tree, start, np.array([3.0, 2.0, 0.5]), (None, None))


def test_a_planner_that_forgets_all_pairs_of_bodies_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = crossing_arms()
    with monkeypatch.context() as forgetful:
        forgetful.setattr(ComponentTree, "collision_pairs", ())
        found = plan(problem, ScheduledGains(), gain_set_name="scheduled")
        assert isinstance(found, Found)
        with pytest.raises(RefusalError, match="arm_0 may touch arm_1"):
            verify_plan(found.plan, problem, GAINS)


def test_pairs_of_bodies_cannot_be_left_aside_for_a_joint_that_they_do_not_share() -> None:
    documents = answered(room_with_pillar(2))
    assert documents is not None
    question, answer = deepcopy(documents[0]), documents[1]
    arms = [k for k, piece in enumerate(question["pieces"]) if piece["component"] > 0]
    question["left_aside"].append([*arms[:2], "joint"])
    assert "share no joint" in refusal(question, answer)
