"""Walls move back, but nothing is broken through."""

from itertools import pairwise

import numpy as np
import pytest
from shapely import LineString, Point, box, union_all

from coop_drake.diagnosis.variants import WidenedFloor

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
