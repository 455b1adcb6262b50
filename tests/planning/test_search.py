"""Questions and their answers: found and sound, proved, refused, or undecided, never wrong."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi
from typing import Literal

import numpy as np
import pytest
from shapely import Polygon, box, union_all

from coop_drake.answers.plan import BeyondLimits, Found, Infeasible
from coop_drake.answers.problem import LIMIT_ROOM, PlannerSettings, PlanningProblem
from coop_drake.errors import PlanError, RefusalError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.channel import Channel, NoChannel
from coop_drake.planning.duration import timed
from coop_drake.planning.planner import plan
from coop_drake.planning.search import find_channel
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint
from coop_drake.verification import verify_plan, verify_proof
from tests.support.cases import case, disc, rectangle
from tests.support.moved import Similarity
from tests.support.short_search import sample_little
from tests.support.soundness import assert_channel_is_sound, no_channel, sound_channel


def rod_problem(corridor: float, settings: PlannerSettings | None = None) -> PlanningProblem:
    """A rod of 1.0 x 0.2 that must pass a corridor along x and may turn in both rooms."""
    tree = ComponentTree(
        (Component("rod", None, None, (Body("rod", None, (rectangle(-0.5, 0.5, -0.1, 0.1),)),)),), frozenset()
    )
    half = 0.5 * corridor
    floor = union_all([box(-4, -1, -1, 1), box(-1.1, -half, 1.1, half), box(1, -1, 4, 1)])
    assert isinstance(floor, Polygon)
    return PlanningProblem(
        floor,
        tree,
        np.array([-2.5, 0.0, 1.5]),
        np.array([2.5, 0.0, 1.5]),
        (),
        settings=settings if settings is not None else PlannerSettings(),
    )


@pytest.mark.parametrize("name", ["base", "tight", "three", "elbow"])
def test_feasible_cases_are_found_and_sound(name: str) -> None:
    problem = case(name)
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert channel.margin > 0.0
    assert_channel_is_sound(problem, channel)


def test_a_joint_that_moves_no_solid_body_is_planned_too() -> None:
    problem = rod_problem(1.0)
    joint = TreeJoint("rod::idle", "revolute", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), -1.0, 1.0)
    bare = Component("bare", 0, joint, ())  # The plant leaves bodies without geometry out of components.
    tree = ComponentTree((*problem.tree.components, bare), frozenset())
    start = np.append(problem.start, 0.8)
    idle = replace(problem, tree=tree, start=start, goal_joints=(-0.8,))
    channel = sound_channel(idle)
    assert channel.boxes[-1].lower[1] <= -0.8 <= channel.boxes[-1].upper[1]


@pytest.mark.parametrize(("corridor", "found"), [(0.23, True), (0.19, False)])
def test_a_rod_passes_a_corridor_wider_than_itself_only(corridor: float, found: bool) -> None:
    problem = rod_problem(corridor)
    channel, _ = find_channel(problem)
    if found:
        assert isinstance(channel, Channel)
        assert_channel_is_sound(problem, channel)
    else:
        assert isinstance(channel, NoChannel)
        assert channel.proved


def test_a_spent_budget_is_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    sample_little(monkeypatch)
    problem = rod_problem(0.2002, PlannerSettings(max_slices=8))
    channel = no_channel(problem, proved=False)
    assert 0.0 < channel.mixed[0].width_fraction <= 1.0


def test_a_start_near_a_wall_does_not_forbid_a_margin() -> None:
    problem = case("base")
    start = problem.start.copy()
    start[0] = 0.28
    near = replace(problem, start=start)
    channel, _ = find_channel(near)
    assert isinstance(channel, Channel)
    assert channel.margin > 0.0
    assert_channel_is_sound(near, channel)


@pytest.mark.parametrize(
    ("pose", "joints"),
    [
        ((5.0, 6.6, 0.0), (None, None)),  # the object is in the door's wall
        ((6.2, 4.5, 0.0), (None, None)),  # a hand fits, the base behind it does not, whatever its joint
        ((5.0, 8.0, 1.57), (0.0, 2.9)),  # a joint beyond its limit puts a base into the other's hand
    ],
)
def test_a_goal_in_collision_is_refuted_at_once(
    pose: tuple[float, float, float], joints: tuple[float | None, float | None]
) -> None:
    channel, report = find_channel(replace(case("base"), goal_pose=np.array(pose), goal_joints=joints))
    assert isinstance(channel, NoChannel)
    assert channel.proved
    assert "at the goal" in channel.reason
    assert report.slices <= 128


def test_progress_is_told_and_may_interrupt() -> None:
    told: list[str] = []

    def stop(phase: str, count: float) -> None:
        told.append(phase)
        assert count >= 0.0
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        find_channel(case("base"), stop)
    assert told == ["sampling paths"]


# Questions at the edge of what can be asked: joints at limits, numbers that mean nothing, odd scales.


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
    ("start", "limits"),
    [(0.5, (-0.5, 0.5)), (-0.5, (-0.5, 0.5)), (0.3, (0.3, 0.3)), (0.3, (0.3, 0.3004)), (0.3, (-20.0, 20.0))],
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
    answer = no_channel(replace(reaching(0.3, (-0.5, 0.5)), goal_joints=(0.7,)))
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


# Floors, teams and ends at the edge of what makes sense: the right answer, or none, never a wrong one.

ROOM = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]
START, GOAL = (0.5, 0.5, 0.0), (3.5, 2.5, 1.0)
HAIR = 1e-6

OPEN_FLOORS = {
    "collinear corners": Polygon(
        [(0, 0), (1, 0), (1.5, 0), (2, 0), (4, 0), (4, 1.3), (4, 3), (2, 3), (0, 3)]
    ),
    "repeated corners": Polygon([(0, 0), (0, 0), (4, 0), (4, 0), (4, 3), (4, 3), (0, 3)]),
    "corners a picometre apart": Polygon([(0, 0), (1e-12, 0), (4, 0), (4, 1e-12), (4, 3), (0, 3)]),
    "edges of a micrometre": Polygon(
        [(0, 0), (2, 0), (2 + HAIR, HAIR), (2 + 2 * HAIR, 0), (4, 0), (4, 3), (0, 3)]
    ),
    "a hairline recess": Polygon([(0, 0), (4, 0), (4, 1), (9, 1 + 1e-7), (4, 1 + 2e-7), (4, 3), (0, 3)]),
    "a hairline wall with a gap": Polygon(
        [(0, 0), (4, 0), (4, 3), (2 + 1e-7, 3), (2, 0.6), (2 - 1e-7, 3), (0, 3)]
    ),
    "a hairline pillar": Polygon(ROOM, [[(2, 0.5), (2 + 1e-7, 0.5), (2, 2.5)]]),
    "a hole that touches the outer ring": Polygon(ROOM, [[(2, 0), (2.5, 1), (1.5, 1)]]),
    "a hole with an edge on the outer ring": Polygon(ROOM, [[(1.5, 0), (2.5, 0), (2, 1)]]),
    "holes that touch": Polygon(ROOM, [[(2, 0.6), (2.3, 1.4), (1.7, 1.4)], [(2, 2.7), (2, 1.4), (1.6, 2)]]),
    "holes that share an edge": Polygon(
        ROOM, [box(1.8, 0.6, 2.2, 1.5).exterior, box(1.8, 1.5, 2.2, 2.6).exterior]
    ),
    "a hole outside": Polygon(ROOM, [[(5, 5), (6, 5), (6, 6)]]),
}
CLOSED_FLOORS = {
    "a hole from wall to wall": Polygon(ROOM, [[(2, 0), (2.2, 1.5), (2, 3), (1.8, 1.5)]]),
    "a wall of a micrometre but for a slit": Polygon(ROOM, [box(2, 1e-3, 2 + 1e-6, 2.999).exterior]),
    "a wall of a picometre but for a slit": Polygon(ROOM, [box(2, 1e-3, 2 + 1e-12, 2.999).exterior]),
    "a slanted notch of a nanometre": Polygon(
        [(0, 0), (2, 0), (2.3, 2.999), (2 + 1e-9, 0), (4, 0), (4, 3), (0, 3)]
    ),
    "nothing": Polygon(),
    "a room too small": box(0.4, 0.4, 0.55, 0.55),
}
BODIES = {
    "a point": disc(0.0),
    "a segment": ConvexShape(np.array([[-0.2, 0.0], [0.2, 0.0]])),
    "a hairline": ConvexShape(np.array([[-0.2, 0.0], [0.2, 0.0], [0.0, 1e-9]])),
    "repeated corners": ConvexShape(
        np.array([[-0.2, -0.1], [0.2, -0.1], [0.2, -0.1], [0.2, 0.1], [-0.2, 0.1]])
    ),
    "collinear corners": ConvexShape(
        np.array([[-0.2, -0.1], [0.0, -0.1], [0.2, -0.1], [0.2, 0.1], [-0.2, 0.1]])
    ),
}


def alone(shape: ConvexShape) -> ComponentTree:
    return ComponentTree((Component("object", None, None, (Body("object", None, (shape,)),)),), frozenset())


def question(
    floor: Polygon,
    start: tuple[float, ...] = START,
    goal: tuple[float, ...] = GOAL,
    tree: ComponentTree | None = None,
) -> PlanningProblem:
    tree = alone(rectangle(-0.2, 0.2, -0.1, 0.1)) if tree is None else tree
    free = (None,) * len(tree.joints)
    return PlanningProblem(
        floor, tree, np.array(start), np.array(goal), free, settings=PlannerSettings(max_slices=100)
    )


def assert_found(problem: PlanningProblem) -> None:
    sound_channel(problem)


@pytest.mark.parametrize("name", OPEN_FLOORS)
def test_an_odd_floor_with_a_wide_way_is_crossed(name: str) -> None:
    assert_found(question(OPEN_FLOORS[name]))


@pytest.mark.parametrize("name", CLOSED_FLOORS)
def test_an_odd_floor_without_a_way_is_refuted(name: str) -> None:
    problem = question(CLOSED_FLOORS[name])
    answer, _ = find_channel(problem)
    assert not isinstance(answer, Channel)
    assert answer.proof is not None
    if not problem.workspace.is_empty:
        verify_proof(answer.proof, problem)


def test_a_corridor_a_millimetre_wider_than_a_disc_is_called_too_narrow() -> None:
    """The centre of the disc may pass, but a governor would need half an hour for the corridor."""
    rooms = [box(0, 0, 2, 2), box(1.9, 0.7, 4.1, 1.301), box(4, 0, 6, 2)]
    problem = question(union_all(rooms), (1.0, 1.0, 0.0), (5.0, 1.0, 0.5), alone(disc(0.3)))
    answer = plan(problem, ScheduledGains(), gain_set_name="scheduled")
    assert isinstance(answer, BeyondLimits)
    narrow, slow = answer.plan.refused_by
    assert (narrow.limit, slow.limit) == ("planner.min_clearance", "planner.max_transition_time")
    assert narrow.value < 0.0006  # There is half a millimetre on either side.
    assert slow.value > 600.0
    verify_plan(answer.plan, problem, {"scheduled": ScheduledGains()})


def test_a_floor_that_crosses_itself_is_left_undecided() -> None:
    answer, _ = find_channel(
        question(Polygon([(0, 0), (4, 3), (4, 0), (0, 3)]), (0.4, 1.5, 1.57), (3.6, 1.5, 1.57))
    )
    assert not isinstance(answer, Channel)
    assert not answer.proved


@pytest.mark.parametrize("name", BODIES)
def test_odd_bodies_are_carried(name: str) -> None:
    assert_found(question(box(0, 0, 4, 3), tree=alone(BODIES[name])))


@pytest.mark.parametrize("goal", [START, (0.5, 0.5, 2 * np.pi), (0.5, 0.5, -1.0), (3.5, 2.5, 100.0)], ids=str)
def test_any_turn_of_the_goal_will_do(goal: tuple[float, float, float]) -> None:
    assert_found(question(box(0, 0, 4, 3), goal=goal))


@pytest.mark.slow
@pytest.mark.no_cover
@pytest.mark.parametrize("aside", [0.0, 1e-9, -1e-9, -0.01])
@pytest.mark.parametrize("end", ["start", "goal"])
def test_an_end_at_a_wall_is_never_found(end: str, aside: float) -> None:
    """Touching counts as a collision; less than the resolution away, or just inside the wall, is no plan.

    The goal reaches to there with its tolerance.
    """
    tolerance = question(box(0, 0, 4, 3)).position_tolerance
    at_start, at_goal = (0.2 + aside, 0.5, 0.0), (0.2 + aside - tolerance, 0.5, 0.0)
    problem = (
        question(box(0, 0, 4, 3), at_start, GOAL)
        if end == "start"
        else question(box(0, 0, 4, 3), START, at_goal)
    )
    answer, _ = find_channel(problem)
    assert not isinstance(answer, Channel)
    if aside > 0.0:
        assert not answer.proved
    if aside < -1e-3:
        assert answer.proved


@pytest.mark.parametrize("aside", [0.0, 1e-9, -1e-9, -0.005])
def test_a_goal_at_a_wall_is_reached_within_its_tolerance(aside: float) -> None:
    problem = question(box(0, 0, 4, 3), START, (0.2 + aside, 0.5, 0.0))
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    end = channel.path[-1, :2]
    assert end[0] > 0.201
    assert np.hypot(*(end - problem.goal_pose[:2])) < problem.position_tolerance


@pytest.mark.parametrize("start", [(-2.0, 0.5, 0.0), (2.5, 1.5, 0.0), (2.0, 1.5, 0.3)])
def test_a_start_outside_or_in_a_pillar_is_refuted(start: tuple[float, float, float]) -> None:
    """In the second the team lies within the pillar as a whole: it crosses no wall there."""
    floor = Polygon(ROOM, [box(2.0, 1.0, 3.0, 2.0).exterior])
    no_channel(question(floor, start))


@pytest.mark.parametrize("start", [(1.0, 1.5, 0.0, 0.0), (3.0, 0.5, 0.0, 0.0)])
def test_a_base_apart_from_the_object_is_not_lost_in_a_pillar_or_outside(start: tuple[float, ...]) -> None:
    """Between joints there may be nothing: then only the base tells that the team is not on the floor."""
    floor = Polygon(ROOM, [box(2.0, 1.0, 3.0, 2.0).exterior])
    joint = TreeJoint("reach", "revolute", 0, 0, PlanarPose(1.5), 1.0, (1.0, 0.0), -1.0, 1.0)
    tree = ComponentTree(
        (
            *alone(rectangle(-0.2, 0.2, -0.1, 0.1)).components,
            Component("base", 0, joint, (Body("base", 0, (disc(0.1),)),)),
        ),
        frozenset(),
    )
    no_channel(question(floor, start, (1.0, 0.6, 0.0), tree))


# A joint without limits is a circle: plans lead through any turn, and proofs close it.

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
