"""Widest passages: known clearances, and what must hold on any floor."""

import numpy as np
import pytest
from hypothesis import given, settings
from shapely import LineString, Point, Polygon, box

from coop_drake.errors import GeometryError
from coop_drake.geometry import BoundaryDistance, PassageFinder, pole
from tests.support.shapes import floors, floors_with_ends

TWO_ROOMS = box(0, 0, 2, 2).union(box(3, 0, 5, 2))


def rooms_joined_by(*gaps):
    """Two rooms side by side, joined by aisles from x = 2 to 3, given as (lower, upper) in y."""
    floor = TWO_ROOMS
    for lower, upper in gaps:
        floor = floor.union(box(1.9, lower, 3.1, upper))
    return floor


@pytest.mark.parametrize("width", [0.8, 0.1, 0.02, 0.002, 1e-4, 1e-6])
def test_clearance_of_an_aisle_is_half_its_width(width):
    passage = PassageFinder(rooms_joined_by((1.0, 1.0 + width))).find((0.5, 0.5), (4.5, 0.5))
    assert passage.clearance == pytest.approx(0.5 * width, rel=0.03)
    assert 1.99 <= passage.narrowest[0] <= 3.01


def test_the_wider_of_two_aisles_is_taken_though_it_is_longer():
    passage = PassageFinder(rooms_joined_by((0.4, 0.6), (1.5, 1.9))).find((0.5, 0.5), (4.5, 0.5))
    assert passage.clearance == pytest.approx(0.2, rel=0.02)
    assert passage.length > 4.3


def test_a_clear_straight_way_is_taken_as_it_is():
    passage = PassageFinder(box(0, 0, 4, 2)).find((1.0, 1.0), (3.0, 0.5))
    assert passage.path.equals(LineString([(1.0, 1.0), (3.0, 0.5)]))
    assert passage.clearance == pytest.approx(0.5)


def test_a_passage_from_a_point_to_itself_has_no_length():
    passage = PassageFinder(box(0, 0, 4, 2)).find((1.0, 0.7), (1.0, 0.7))
    assert passage.length == 0.0
    assert passage.clearance == pytest.approx(0.7)


@given(floors_with_ends())
@settings(max_examples=60)
def test_a_passage_keeps_its_clearance_and_is_no_wider_than_its_ends(floor_with_ends):
    floor, (start, end) = floor_with_ends
    passage = PassageFinder(floor).find(start, end)
    distance = BoundaryDistance(floor)
    assert floor.contains(passage.path)
    assert floor.boundary.distance(passage.path) == pytest.approx(passage.clearance, abs=1e-12)
    assert passage.clearance <= min(distance(start), distance(end)) + 1e-12
    assert distance(passage.narrowest) == pytest.approx(passage.clearance, abs=1e-9)
    assert passage.path.coords[0] == tuple(start)
    assert passage.path.coords[-1] == tuple(end)


@given(floors_with_ends())
@settings(max_examples=25)
def test_no_passage_is_much_wider_than_the_one_found(floor_with_ends):
    floor, (start, end) = floor_with_ends
    passage = PassageFinder(floor).find(start, end)
    eroded = floor.buffer(-1.1 * passage.clearance - 0.002)
    parts = [part for part in getattr(eroded, "geoms", [eroded]) if not part.is_empty]
    reach = 1e-6
    holds = [{k for k, part in enumerate(parts) if part.distance(Point(p)) < reach} for p in (start, end)]
    assert not holds[0] & holds[1]


@given(floors())
@settings(max_examples=40)
def test_the_pole_has_nearly_the_most_room(floor):
    centre, room = pole(floor)
    assert room == pytest.approx(BoundaryDistance(floor)(centre))
    assert floor.buffer(-room - 2e-3).is_empty


def test_the_same_question_gives_the_same_bits():
    floor = rooms_joined_by((0.4, 0.6), (1.5, 1.9))
    first, second = (PassageFinder(floor).find((0.5, 0.5), (4.5, 0.5)) for _ in range(2))
    assert first.path.wkb == second.path.wkb
    np.testing.assert_array_equal(first.narrowest, second.narrowest)


def test_ends_outside_and_ends_in_different_places_are_refused():
    with pytest.raises(GeometryError, match="must lie inside"):
        PassageFinder(box(0, 0, 1, 1)).find((0.5, 0.5), (1.5, 0.5))
    pinched = Polygon([(0, 0), (1, 0.5), (2, 0), (2, 1), (1, 0.5 + 1e-12), (0, 1)])
    with pytest.raises(GeometryError, match="no passage joins"):
        PassageFinder(pinched).find((0.2, 0.5), (1.8, 0.5))


def test_a_polygon_without_area_has_no_pole():
    with pytest.raises(GeometryError, match="without area"):
        pole(Polygon())
