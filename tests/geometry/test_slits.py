"""Slits: no hole is left, the passage stays open."""

import pytest
from hypothesis import given, settings
from shapely import LineString, Point, box

from coop_drake.geometry import BoundaryDistance, PassageFinder, cut_holes
from coop_drake.geometry.tidy import WIDTH
from tests.support.shapes import floors_with_ends

HALL = box(0, 0, 6, 4)


def test_a_slit_lies_on_the_side_away_from_the_passage():
    hole = box(2, 1.5, 3, 2.5)
    room = HALL.difference(hole)
    path = LineString([(0.5, 3.2), (5.5, 3.2)])
    cut = cut_holes(room, path, 0.5)
    assert not cut.interiors
    assert cut.contains(path)
    # From the lower left corner straight down, and as deep into the hole as the strip is wide.
    strip = box(2 - WIDTH / 2, 0, 2 + WIDTH / 2, 1.5 + WIDTH)
    lost = room.difference(cut)
    assert lost.symmetric_difference(strip.difference(hole)).area < 1e-12


def test_holes_in_a_row_hang_together():
    room = HALL
    for x in (1, 2, 3, 4):
        room = room.difference(box(x, 1.8, x + 0.9, 2.2))
    path = LineString([(0.5, 3.0), (5.5, 3.0)])
    cut = cut_holes(room, path, 0.5)
    assert not cut.interiors
    assert path.distance(cut.boundary) == pytest.approx(path.distance(room.boundary))


def test_a_passage_between_two_holes_stays_open():
    room = HALL.difference(box(2.5, 0.6, 3.5, 1.9)).difference(box(2.5, 2.1, 3.5, 3.4))
    path = LineString([(0.5, 2.0), (5.5, 2.0)])
    cut = cut_holes(room, path, 0.1)
    assert not cut.interiors
    assert path.distance(cut.boundary) == pytest.approx(0.1)


def test_a_room_without_holes_stays_as_it_is():
    assert cut_holes(HALL, LineString([(1, 1), (2, 2)]), 0.3).equals(HALL)


@given(floors_with_ends())
@settings(max_examples=60)
def test_no_hole_is_left_and_the_passage_stays_inside(floor_with_ends):
    floor, (start, end) = floor_with_ends
    passage = PassageFinder(floor).find(start, end)
    cut = cut_holes(floor, passage.path, passage.clearance)
    assert cut.is_valid
    assert not cut.interiors
    assert floor.buffer(1e-9).covers(cut)
    assert cut.contains(Point(start))
    assert cut.contains(Point(end))
    assert BoundaryDistance(cut)(start) > 0.0
    assert cut.boundary.distance(passage.path) >= 0.4 * passage.clearance
