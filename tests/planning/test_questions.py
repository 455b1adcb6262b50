"""Questions at the edge of what can be asked: joints at limits, numbers that mean nothing, odd scales."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import box

from coop_drake.answers.plan import BeyondLimits, Found
from coop_drake.answers.problem import LIMIT_ROOM, PlanningProblem
from coop_drake.errors import PlanError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.channel import Channel, NoChannel
from coop_drake.planning.duration import timed
from coop_drake.planning.planner import plan
from coop_drake.planning.search import find_channel
from coop_drake.tree.component_tree import Body, Component, ComponentTree, TreeJoint
from coop_drake.tree.pose import PlanarPose
from coop_drake.verification import verify_plan, verify_proof
from tests.planning.test_search import rod_problem
from tests.support.cases import case, rectangle
from tests.support.moved import Similarity


def reaching(start: float, limits: tuple[float, float], kind: str = "revolute") -> PlanningProblem:
    """A bar with one arm in an empty room."""
    joint = TreeJoint("arm", kind, 0, 0, PlanarPose(0.2), 1.0, (0.6, 0.8), *limits)
    bar = Component("bar", None, None, (Body("bar", None, (rectangle(-0.2, 0.2, -0.1, 0.1),)),))
    arm = Component("arm", 0, joint, (Body("arm", 0, (rectangle(0.0, 0.3, -0.02, 0.02),)),))
    tree = ComponentTree((bar, arm), frozenset({("arm", "bar")}))
    pose = np.array([0.8, 0.8, 0.0, start])
    return PlanningProblem(box(0, 0, 4, 3), tree, pose, np.array([3.0, 2.0, 1.0]), (None,))


def within_limits(tree: ComponentTree) -> ComponentTree:
    """The same team with the arm's limits as its model has them."""
    arm = tree.components[1]
    assert arm.joint is not None
    return replace(
        tree,
        components=(tree.components[0], replace(arm, joint=replace(arm.joint, lower=-0.5, upper=0.5))),
    )


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
@pytest.mark.parametrize(
    ("start", "limits"), [(0.5, (-0.5, 0.5)), (-0.5, (-0.5, 0.5)), (0.3, (0.3, 0.3)), (0.3, (0.3, 0.3004))]
)
def test_a_joint_at_its_limit_or_of_no_range_is_planned(kind, start: float, limits) -> None:
    problem = reaching(start, limits, kind)
    gains = ScheduledGains()
    answer = plan(problem, gains, gain_set_name="scheduled")
    assert isinstance(answer, Found)
    verify_plan(answer.plan, problem, {"scheduled": gains})
    room = LIMIT_ROOM + 1e-12
    for cell in answer.plan.cells:
        assert limits[0] - room <= cell.lower[1]
        assert cell.upper[1] <= limits[1] + room


def test_a_joint_within_its_limits_gets_no_room() -> None:
    problem = reaching(0.3, (-0.5, 0.5))
    assert (problem.tree.joints[0].lower, problem.tree.joints[0].upper) == (-0.5, 0.5)
    assert replace(problem, start=problem.start).tree is problem.tree


def test_a_joint_that_misses_its_limit_by_rounding_gets_room_too() -> None:
    problem = reaching(float(np.nextafter(0.5, 1.0)), (-0.5, 0.5))
    assert problem.tree.joints[0].upper > 0.505


def test_a_goal_just_beyond_a_limit_does_not_profit_from_the_room_of_a_start_at_it() -> None:
    problem = reaching(0.5, (-0.5, 0.5))
    beyond = PlanningProblem(
        problem.workspace, within_limits(problem.tree), problem.start, problem.goal_pose, (0.505,)
    )
    channel, _ = find_channel(beyond)
    assert isinstance(channel, Channel)
    assert channel.boxes[-1].upper[1] <= 0.5
    assert 0.485 < channel.path[-1, 3] < 0.5


def test_a_goal_beyond_a_limit_is_infeasible_for_that_reason() -> None:
    answer, _ = find_channel(replace(reaching(0.3, (-0.5, 0.5)), goal_joints=(0.7,)))
    assert isinstance(answer, NoChannel)
    assert answer.proved
    assert answer.reason == "at the goal arm is 0.7, beyond its limits [-0.5, 0.5] by more than its tolerance"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"start": np.array([0.8, np.nan, 0.0, 0.3])},
            r"start: \[0.8, nan, 0.0, 0.3\] is not allowed; expected 4",
        ),
        ({"start": np.array([0.8, 0.8, 0.0])}, r"start: .* expected 4 finite numbers: x, y, theta and every"),
        ({"start": np.array([0.8, 0.8, 0.0, 0.6])}, r"start: 0.6 of arm is not allowed; .* \[-0.5, 0.5\]"),
        (
            {"goal_pose": np.array([3.0, 2.0, np.inf])},
            r"goal_pose: \[3.0, 2.0, inf\] is not allowed; expected 3",
        ),
        ({"goal_joints": (np.nan,)}, "goal_joints: nan of arm is not allowed; expected a finite number"),
        ({"goal_joints": (None, None)}, "goal_joints: .* expected 1 entries"),
    ],
)
def test_numbers_that_mean_nothing_are_refused(change, message: str) -> None:
    with pytest.raises(PlanError, match=message):
        find_channel(replace(reaching(0.3, (-0.5, 0.5)), **change))


@pytest.mark.parametrize("limits", [(-np.inf, 0.5), (-0.5, np.inf), (0.0, np.nan), (0.5, 0.1)])
def test_joints_need_two_limits(limits) -> None:
    with pytest.raises(PlanError, match=r"limits of arm: .* are not allowed; expected two finite limits"):
        find_channel(reaching(0.3, limits))


@pytest.mark.parametrize("scale", [0.1, 1000.0])
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_the_margin_grows_and_shrinks_with_the_scene(kind, scale: float) -> None:
    """Whether or not whoever measures in another unit thinks of the margin in the settings."""
    problem = reaching(0.3, (-0.5, 0.5), kind)
    found, _ = find_channel(problem)
    assert isinstance(found, Channel)
    moved = Similarity(scale=scale).question(problem)
    for settings in (moved.settings, problem.settings):
        channel, _ = find_channel(replace(moved, settings=settings))
        assert isinstance(channel, Channel)
        assert 0.5 * found.margin < channel.margin / scale < 2.0 * found.margin


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-3, 1000.0])
def test_a_transport_is_planned_and_verified_in_any_unit(scale: float) -> None:
    """Gains have bounds in metres: the largest and the smallest teams move slowly, and their plans say so."""
    problem = Similarity(scale=scale).question(case("base"))
    problem = replace(problem, settings=replace(problem.settings, max_transition_time=1000.0))
    found = plan(problem, ScheduledGains(), gain_set_name="scheduled")
    assert isinstance(found, Found)
    verify_plan(found.plan, problem, {"scheduled": ScheduledGains()})


def test_a_limit_refuses_a_plan_at_another_scale_too() -> None:
    problem = Similarity(scale=64.0).question(reaching(0.3, (-0.5, 0.5)))
    hurried = replace(problem.settings, max_transition_time=1.0)
    answer = plan(replace(problem, settings=hurried), ScheduledGains(), gain_set_name="scheduled")
    assert isinstance(answer, BeyondLimits)
    (refusal,) = answer.plan.refused_by
    assert (refusal.limit, refusal.allowed) == ("planner.max_transition_time", 1.0)
    assert refusal.value == pytest.approx(max(t.estimated_time for t in timed(answer.plan).transitions))
    assert refusal.value > 1.0


@pytest.mark.parametrize("scale", [0.1, 1000.0])
def test_proofs_at_other_scales_hold(scale: float) -> None:
    refuted = Similarity(scale=scale).question(rod_problem(0.19))
    answer, _ = find_channel(refuted)
    assert isinstance(answer, NoChannel)
    assert answer.proof is not None
    verify_proof(answer.proof, refuted)
