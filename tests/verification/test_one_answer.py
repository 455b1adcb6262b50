"""One question has one answer: a "no" covers all of the goal, a "found" ends within it."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import box

from coop_drake.answers.digest import problem_digest
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import PlanarPose
from coop_drake.verification import verify_plan, verify_proof
from tests.support.certificates import GAINS

BAR = ConvexShape(np.array([[-0.6, -0.1], [0.6, -0.1], [0.6, 0.1], [-0.6, 0.1]]), 0.0)
ARM = ConvexShape(np.array([[0.0, -0.05], [0.3, -0.05], [0.3, 0.05], [0.0, 0.05]]), 0.0)


def tree(*, arm: bool) -> ComponentTree:
    """A bar, if asked for with an arm at its end that turns by 1 rad at most."""
    components = [Component("bar", None, None, (Body("bar", None, (BAR,)),))]
    if arm:
        joint = TreeJoint("arm", "revolute", 0, 0, PlanarPose(0.6, 0.0, 0.0), 1.0, (1.0, 0.0), -1.0, 1.0)
        components.append(Component("arm", 0, joint, (Body("arm", 0, (ARM,)),)))
    return ComponentTree(tuple(components), frozenset({("bar", "arm")}))


ROOM, SLOT = box(0.0, 0.0, 6.0, 4.0), box(0.0, 0.0, 3.0, 4.0).union(box(2.9, 1.875, 6.0, 2.125))
START = np.array([1.5, 2.0, 0.0])

ASKED = {
    "position": (ROOM, (5.405, 2.0, 0.0), None, {"position_tolerance": 0.01}, (5.397, 2.0, 0.0), None),
    "angle": (SLOT, (5.0, 2.0, 0.05), None, {"angle_tolerance": 0.03}, (5.0, 2.0, 0.03), None),
    "angle and a turn": (
        SLOT,
        (5.0, 2.0, 0.05 + 4 * np.pi),
        None,
        {"angle_tolerance": 0.03},
        (5.0, 2.0, 0.03),
        None,
    ),
    "joint": (ROOM, (5.11, 2.0, 0.0), 0.44, {"joint_tolerance": 0.06}, (5.11, 2.0, 0.0), 0.492),
    "limit": (ROOM, (4.0, 2.0, 0.0), 1.005, {"joint_tolerance": 0.02}, (4.0, 2.0, 0.0), 0.987),
}
"""Floor, goal, tolerance, and a free end within it; at the goals the team collides or is beyond a limit."""

SMALLER = {"position": 0.004, "angle": 0.005, "angle and a turn": 0.005, "joint": 0.01, "limit": 0.004}
"""Tolerances within which there is no free end."""


def asked(name: str, share: float = 1.0, *, end: bool = False) -> PlanningProblem:
    """A question, with a share of its tolerances, about its goal or about an end within the tolerance."""
    floor, *goal, tolerance, place, value = ASKED[name]
    pose, joint = (place, value) if end else goal
    arm = joint is not None
    return PlanningProblem(
        floor,
        tree(arm=arm),
        np.array([*START, 0.0]) if arm else START,
        np.array(pose),
        (joint,) if arm else (),
        **{
            "position_tolerance": 1e-3 * share,
            "angle_tolerance": 1e-3 * share,
            "joint_tolerance": 1e-3 * share,
        }
        | {key: share * most for key, most in tolerance.items()},
    )


def answer(problem: PlanningProblem):
    return plan(problem, ScheduledGains(), gain_set_name="scheduled")


@pytest.mark.parametrize("name", ASKED)
def test_a_goal_that_is_blocked_with_a_free_end_within_its_tolerance_has_one_answer(name):
    question = asked(name)
    exactly = answer(asked(name, 1e-6))
    assert verify_proof(exactly.proof, asked(name, 1e-6)).answer == "infeasible"
    with pytest.raises(RefusalError, match="cells may hold the goal and have reached: True"):
        verify_proof(exactly.proof, question)
    near = answer(replace(asked(name, 0.05, end=True), position_tolerance=1e-3)).plan
    stated = replace(
        near, problem=problem_digest(question), goal_pose=question.goal_pose, goal_joints=question.goal_joints
    )
    assert verify_plan(stated, question, GAINS).answer == "found"


@pytest.mark.parametrize(("name", "tolerance"), SMALLER.items())
def test_a_no_covers_all_of_the_tolerance(name, tolerance):
    ((key, _),) = ASKED[name][3].items()
    question = replace(asked(name), **{key: tolerance})
    assert verify_proof(answer(question).proof, question).answer == "infeasible"


@pytest.mark.parametrize("name", ASKED)
def test_a_free_end_within_the_tolerance_is_found(name):
    question = replace(asked(name), position_tolerance=0.01)
    found = answer(question).plan
    assert verify_plan(found, question, GAINS).answer == "found"
    np.testing.assert_array_equal(found.goal_pose[:2], question.goal_pose[:2])
