"""One question has one answer: a "no" covers all of the goal, a "found" ends within it."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import box

from coop_drake.answers.document import problem_digest
from coop_drake.answers.plan import SLOWEST_AGE, Refusal
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from coop_drake.planning.transitions import reschedule
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint
from coop_drake.verification import verify_plan, verify_proof
from tests.support.certificates import GAINS, bent_corridor

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
    "turn": (SLOT, (5.0, 2.0, 0.05 + 4 * np.pi), None, {"angle_tolerance": 0.03}, (5.0, 2.0, 0.03), None),
    "joint": (ROOM, (5.11, 2.0, 0.0), 0.44, {"joint_tolerance": 0.06}, (5.11, 2.0, 0.0), 0.492),
    "limit": (ROOM, (4.0, 2.0, 0.0), 1.005, {"joint_tolerance": 0.02}, (4.0, 2.0, 0.0), 0.987),
}
"""Floor, goal, tolerance, and a free end within it; at the goals the team collides or is beyond a limit."""

SMALLER = {"position": 0.004, "angle": 0.005, "turn": 0.005, "joint": 0.01, "limit": 0.004}
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
        **dict.fromkeys(("position_tolerance", "angle_tolerance", "joint_tolerance"), 1e-3 * share)
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


def limited(problem: PlanningProblem, **limits: float) -> PlanningProblem:
    return replace(problem, settings=replace(problem.settings, **limits))


SLOW = Refusal("planner.max_transition_time", 0, 1e6, 60.0, "s")
NARROW = Refusal("planner.min_clearance", 0, 1e-9, 1e-3, "m")


@pytest.fixture(scope="module")
def found():
    problem = bent_corridor(1.2)
    return problem, answer(problem).plan


@pytest.fixture(scope="module")
def way():
    problem = limited(bent_corridor(1.2), min_clearance=0.4, max_transition_time=0.3)
    return problem, answer(problem).plan


def first(plan, **change):
    """A plan with other numbers in its first transition."""
    return replace(plan, transitions=(replace(plan.transitions[0], **change), *plan.transitions[1:]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "stated"), [(0.0, ()), (1e6, (SLOW,)), (59.0, (replace(SLOW, value=61.0),))]
)
def test_an_estimated_time_that_no_simulation_gives_makes_no_answer(found, seconds, stated):
    problem, plan = found
    with pytest.raises(RefusalError, match=r"transitions\[0\].estimated_time: is .* the simulation"):
        verify_plan(replace(first(plan, estimated_time=seconds), refused_by=stated), problem, GAINS)


@pytest.mark.parametrize(
    "stated",
    [
        SLOW,
        NARROW,
        replace(NARROW, limit="planner.margin"),
        Refusal("limits.joint_accelerations", 0, 99.0, 1.0, "rad/s^2", "robot_0::joint"),
    ],
)
def test_a_plan_that_keeps_its_limits_is_not_beyond_them(found, stated):
    problem, plan = found
    with pytest.raises(RefusalError, match=r"refused_by\[0\]: .* or it is kept"):
        verify_plan(replace(plan, refused_by=(stated,)), problem, GAINS)


@pytest.mark.parametrize("key", ["neck", "inradius"])
def test_a_clearance_that_is_stated_too_small_is_not_below_a_limit(found, key):
    problem, plan = found
    small = first(plan, **{key: 1e-4})
    with pytest.raises(RefusalError, match=r"transitions\[0\].gains|refused_by\[0\]: .* or it is kept"):
        verify_plan(replace(small, refused_by=(replace(NARROW, value=1e-4),)), problem, GAINS)


@pytest.mark.slow
def test_a_way_says_all_limits_that_it_breaks_and_no_other(way):
    problem, plan = way
    assert {one.limit for one in plan.refused_by} == {SLOW.limit, NARROW.limit}
    assert verify_plan(plan, problem, GAINS).answer == "beyond limits"
    for stated in ((), plan.refused_by[:1], plan.refused_by[1:]):
        with pytest.raises(RefusalError, match="refused_by: does not say that the plan breaks planner"):
            verify_plan(replace(plan, refused_by=stated), problem, GAINS)
    for k, one in enumerate(plan.refused_by):
        for change in ({"value": 1.01 * one.value + 0.1}, {"cell": 99}, {"allowed": 2.0 * one.allowed}):
            stated = (*plan.refused_by[:k], replace(one, **change), *plan.refused_by[k + 1 :])
            with pytest.raises(RefusalError, match=rf"refused_by\[{k}\]"):
                verify_plan(replace(plan, refused_by=stated), problem, GAINS)


def test_a_way_is_not_made_slower_until_a_limit_refuses_it(found):
    """Gains for commands seven times as old are allowed to a plan, and need more time."""
    problem, plan = found
    slowly = reschedule(replace(plan, age_factor=SLOWEST_AGE), ScheduledGains(), "scheduled")
    cell, most = max(enumerate(one.estimated_time for one in slowly.transitions), key=lambda pair: pair[1])
    asked = limited(problem, max_transition_time=0.5 * most)
    assert max(one.estimated_time for one in plan.transitions) < 0.5 * most
    stated = replace(slowly, refused_by=(replace(SLOW, cell=cell, value=most, allowed=0.5 * most),))
    assert verify_plan(plan, asked, GAINS).answer == "found"
    with pytest.raises(RefusalError, match=r"age_factor: is 7\.0"):
        verify_plan(stated, asked, GAINS)
