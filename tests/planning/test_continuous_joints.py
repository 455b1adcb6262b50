"""A joint without limits is a circle: plans lead through any turn, and proofs close it."""

from math import inf, pi
from typing import Literal

import numpy as np
import pytest
from shapely import box

from coop_drake.answers.plan import Found, Infeasible
from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.errors import PlanError, RefusalError
from coop_drake.laws.gains import ScheduledGains
from coop_drake.planning.channel import Channel
from coop_drake.planning.planner import plan
from coop_drake.planning.search import find_channel
from coop_drake.tree.component_tree import Body, Component, ComponentTree, TreeJoint
from coop_drake.tree.pose import PlanarPose
from coop_drake.verification import verify_plan, verify_proof
from tests.support.cases import rectangle
from tests.support.soundness import assert_channel_is_sound

GAINS = {"scheduled": ScheduledGains()}


def turret(
    start: float = 3.0,
    goal: float | None = -3.1,
    *,
    limits: tuple[float, float] = (-inf, inf),
    sign: float = 1.0,
    back: bool = False,
    strategy: Literal["portfolio", "cells", "paper"] = "portfolio",
) -> PlanningProblem:
    """An object, and a base that turns about the end of an arm: the object is in its way at zero.

    With ``back``, a bar beyond the joint that the object carries is in its way at pi.
    """
    bodies = [Body("object", None, (rectangle(-0.3, 0.3, -0.15, 0.15),))]
    if back:
        bodies.append(Body("bar", None, (rectangle(0.9, 1.1, -0.15, 0.15),)))
    joint = TreeJoint("turret", "revolute", 0, 0, PlanarPose(0.6), sign, (0.0, 0.0), *limits)
    base = Body("base", 0, (rectangle(-0.5, 0.2, -0.1, 0.1),))
    tree = ComponentTree(
        (Component("object", None, None, tuple(bodies)), Component("base", 0, joint, (base,))), frozenset()
    )
    pose, aim = np.array([6.0, 6.0, 0.0, start]), np.array([6.5, 6.0, 0.3])
    return PlanningProblem(
        box(0.0, 0.0, 12.0, 12.0), tree, pose, aim, (goal,), settings=PlannerSettings(strategy=strategy)
    )


def found(problem: PlanningProblem):
    """The plan that is found, verified."""
    answer = plan(problem, GAINS["scheduled"], gain_set_name="scheduled")
    assert isinstance(answer, Found)
    verify_plan(answer.plan, problem, GAINS)
    return answer.plan


def refuted(problem: PlanningProblem):
    """The proof that there is no plan, verified."""
    answer = plan(problem, GAINS["scheduled"], gain_set_name="scheduled")
    assert isinstance(answer, Infeasible)
    assert answer.proof is not None
    verify_proof(answer.proof, problem)
    return answer.proof


@pytest.mark.parametrize("goal", [-3.1, 3.3, 3.3 - 2.0 * pi, 3.3 + 6.0 * pi])
@pytest.mark.parametrize("strategy", ["portfolio", "cells", "paper"])
def test_a_joint_turns_through_pi_to_a_goal_modulo_a_turn(goal, strategy):
    made = found(turret(goal=goal, strategy=strategy))
    nearest = goal - 2.0 * pi * round((goal - 3.0) / (2.0 * pi))
    assert made.goal_joints == pytest.approx((nearest,))
    assert made.transitions[-1].goal_lower[1] < nearest < made.transitions[-1].goal_upper[1]
    assert made.start[3] == 3.0


@pytest.mark.parametrize("start", [3.0 - 2.0 * pi, 3.0 + 8.0 * pi])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_may_begin_in_any_turn(start, sign):
    made = found(turret(start, sign=sign))
    assert made.cells[0].lower[1] < start < made.cells[0].upper[1]
    assert made.goal_joints == pytest.approx((start + 0.18318530717958612,))


def test_a_free_joint_ends_anywhere():
    assert found(turret(9.0, None)).goal_joints == (None,)


def test_a_goal_across_the_turn_that_is_blocked_is_reached_the_other_way():
    """From 1.2 to -1.2 zero is in between; through pi it is further, and free."""
    made = found(turret(1.2, -1.2))
    assert made.goal_joints == pytest.approx((2.0 * pi - 1.2,))
    channel, _ = find_channel(turret(1.2, -1.2, strategy="cells"))
    assert isinstance(channel, Channel)
    assert_channel_is_sound(turret(1.2, -1.2), channel)


def test_limits_of_half_a_turn_are_kept_and_their_proof_is_refused_for_the_circle():
    limited = turret(1.2, -1.2, limits=(-pi, pi), strategy="cells")
    forged = refuted(limited)
    with pytest.raises(RefusalError, match="another label"):
        verify_proof(forged, turret(1.2, -1.2))


@pytest.mark.slow
def test_both_ways_round_are_proved_to_be_blocked():
    proof = refuted(turret(1.5, -1.5 + 4.0 * pi, back=True, strategy="cells"))
    ends = np.array([[part.lower[1], part.upper[1]] for part in proof.slices])
    assert (ends.min(), ends.max()) == (-pi, pi)
    assert found(turret(1.5, 1.7 - 2.0 * pi, back=True))


@pytest.mark.parametrize("goal", [0.0, 4.0 * pi])
def test_a_goal_that_is_blocked_is_proved_in_any_turn(goal):
    assert refuted(turret(goal=goal)).kind == "blocked goal"


@pytest.mark.parametrize("limits", [(-1.0, inf), (-inf, 3.5)])
def test_one_limit_is_no_circle(limits):
    with pytest.raises(PlanError, match="turret"):
        find_channel(turret(limits=limits))
