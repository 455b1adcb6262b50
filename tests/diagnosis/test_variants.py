"""Variants of a question: walls move back, bodies shrink, joints widen, given paths are free or not."""

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from shapely import LineString, Point, Polygon, box, union_all

from coop_drake.answers.problem import PlanningProblem
from coop_drake.diagnosis.diagnosing import changes, shrunk_bodies, widened_joints
from coop_drake.diagnosis.variants import WidenedFloor, is_free
from coop_drake.tree.component_tree import Body, Component, ComponentTree
from tests.planning.test_search import turret
from tests.support.cases import disc, rectangle, team_tree
from tests.support.trees import placed_shape

INSIDE = np.array([0.5, 0.5])
THICKNESS = 0.1


def two_rooms(door: float = 0.6):
    """Rooms of 3 m beside each other; the wall between them is 0.1 m thick and has a door in its middle."""
    half = 0.5 * door
    return union_all([box(0, 0, 3, 3), box(3.1, 0, 6, 3), box(2.9, 1.5 - half, 3.2, 1.5 + half)])


@pytest.mark.parametrize("amount", [0.02, 0.049, 0.051, 0.2, 0.4])
def test_a_door_grows_by_twice_the_amount_and_its_wall_stays_a_wall(amount):
    grown = WidenedFloor(two_rooms(), INSIDE, 0.5).everywhere(amount)
    half = 0.3 + amount
    assert grown.is_valid
    assert grown.contains(two_rooms())
    for y in np.linspace(0.2, 1.5 - half - 0.02, 5):
        assert not grown.contains(LineString([(2.9, y), (3.2, y)]))
        assert not grown.contains(LineString([(2.9, 3.0 - y), (3.2, 3.0 - y)]))
    assert grown.contains(LineString([(3.05, 1.5 - half + 0.02), (3.05, 1.5 + half - 0.02)]))


@pytest.mark.parametrize("amount", [0.06, 0.3])
def test_a_wall_without_a_door_keeps_its_rooms_apart(amount):
    rooms = union_all([box(0, 0, 3, 3), box(3 + THICKNESS, 0, 6, 3), box(0, -2, 6, 0.5)])
    grown = WidenedFloor(rooms, INSIDE, 0.5).everywhere(amount)
    for y in (0.7 + amount, 2.0, 2.9, 3.0 + 0.9 * amount):
        assert not grown.contains(LineString([(2.8, y), (3.3, y)]))


def test_more_growth_gives_more_floor():
    floor = WidenedFloor(two_rooms(), INSIDE, 0.5)
    floors = [floor.everywhere(amount) for amount in (0.0, 0.03, 0.07, 0.15, 0.4)]
    assert floors[0].equals(two_rooms())
    for less, more in pairwise(floors):
        assert more.buffer(1e-6).contains(less)


def test_a_pillar_shrinks_and_goes():
    floor = box(0, 0, 4, 4).difference(box(1.8, 1.8, 2.2, 2.2))
    floor = WidenedFloor(floor, INSIDE, 0.5)
    assert not floor.everywhere(0.1).contains(Point(2.05, 2.05))
    assert floor.everywhere(0.1).contains(Point(1.85, 2.0))
    assert len(floor.everywhere(0.25).interiors) == 0


def test_growth_round_a_place_leaves_the_rest_as_it_is():
    floor = WidenedFloor(two_rooms(), INSIDE, 0.5)
    grown = floor.around([(Point(3.05, 1.5).buffer(0.8), 0.1)])
    assert grown.contains(Point(3.05, 1.85))
    assert not grown.contains(Point(3.05, 1.95))
    assert not grown.covers(Point(-0.01, 0.5))


FOOT, LEG, OTHER = rectangle(0, 1, 0, 0.2), rectangle(0, 0.2, 0, 1), rectangle(0.8, 1, 0, 1)
BODIES = {
    "disc": ((disc(0.3),), True),
    "bar": ((FOOT,), True),
    "L": ((FOOT, LEG), True),
    "U": ((FOOT, LEG, OTHER), False),
}


def outline(tree: ComponentTree):
    body = tree.components[0].bodies[0]
    return union_all([placed_shape(shape, tree.poses((0.0, 0.0, 0.0))[0]) for shape in body.shapes])


@pytest.mark.parametrize("name", BODIES)
def test_a_body_that_is_seen_from_a_point_of_it_shrinks_into_itself(name: str) -> None:
    shapes, inwards = BODIES[name]
    tree = ComponentTree((Component("box", None, None, (Body("box", None, shapes),)),), frozenset())
    (smaller,) = changes(tree)
    assert smaller.monotone is inwards
    sizes = [outline(shrunk_bodies(tree, {"box"}, factor)) for factor in (1.0, 0.7, 0.3)]
    nested = all(larger.buffer(1e-9).covers(less) for larger, less in pairwise(sizes))
    assert nested is inwards


def test_joints_without_limits_are_not_widened() -> None:
    endless, limited = turret().tree, turret(limits=(-3.0, 3.0)).tree
    assert widened_joints(endless, 1.0).joints == endless.joints
    (wider,) = widened_joints(limited, 1.0).joints
    assert (wider.lower, wider.upper, wider.circular) == (-pi, pi, False)
    assert "wider joint range" not in [change.name for change in changes(endless)]
    assert "wider joint range" in [change.name for change in changes(limited)]


PILLAR = box(4.0, 4.0, 9.0, 9.0)
FLOOR = Polygon(box(0.0, 0.0, 20.0, 20.0).exterior.coords, [PILLAR.exterior.coords])


def test_a_path_is_free_on_the_floor_and_not_inside_a_pillar_that_it_never_leaves():
    for x, free in ((12.0, True), (6.0, False)):
        start = np.array([x, 6.5, 0.0, 0.0])
        path = np.stack((start, start + np.array([0.5, 0.0, 0.1, 0.1])))
        problem = PlanningProblem(FLOOR, team_tree(1, 1), start, path[-1, :3], (None,))
        assert is_free(problem, path)[0] is free
