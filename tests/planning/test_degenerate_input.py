"""Floors, teams and ends at the edge of what makes sense: the right answer, or none, never a wrong one."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box, union_all

from coop_drake.answers.plan import BeyondLimits
from coop_drake.answers.problem import PlannerSettings, PlanningProblem
from coop_drake.laws import ScheduledGains
from coop_drake.planning.channel import Channel
from coop_drake.planning.planner import plan
from coop_drake.planning.search import find_channel
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import PlanarPose
from coop_drake.verification import verify_plan, verify_proof
from tests.support.cases import disc, rectangle
from tests.support.soundness import assert_channel_is_sound

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
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(problem, channel)


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
    answer, _ = find_channel(question(floor, start))
    assert not isinstance(answer, Channel)
    assert answer.proved


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
    answer, _ = find_channel(question(floor, start, (1.0, 0.6, 0.0), tree))
    assert not isinstance(answer, Channel)
    assert answer.proved


@pytest.mark.parametrize("range_", [(0.3, 0.3), (0.3, 0.3 + 1e-9), (-20.0, 20.0)])
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_joints_that_cannot_move_or_move_very_far_are_planned(kind, range_: tuple[float, float]) -> None:
    joint = TreeJoint("arm", kind, 0, 0, PlanarPose(0.2), 1.0, (0.6, 0.8), *range_)
    arm = Component("arm", 0, joint, (Body("arm", 0, (rectangle(0.0, 0.3, -0.02, 0.02),)),))
    tree = ComponentTree(
        (*alone(rectangle(-0.2, 0.2, -0.1, 0.1)).components, arm), frozenset({("arm", "object")})
    )
    channel, _ = find_channel(question(box(0, 0, 5, 4), (0.8, 0.8, 0.0, 0.3), tree=tree))
    assert isinstance(channel, Channel)
