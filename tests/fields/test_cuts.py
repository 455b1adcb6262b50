"""Cells cut open: simply connected, the widest passage untouched, every start at the goal in good time."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from shapely import Point, Polygon, box

from coop_drake.errors import FieldError
from coop_drake.fields import HarmonicMap, VelocityField, cut_open, trace_streamlines
from coop_drake.geometry import PassageFinder
from tests.support import domains
from tests.support.shapes import floors_with_ends

HALL = box(0, 0, 6, 4)
CRATE = box(2, 1.5, 3, 2.5)


def test_every_start_between_long_shelves_arrives_in_good_time():
    domain, goal = domains.long_shelves()
    cell = cut_open(domain, goal)
    field = VelocityField(HarmonicMap(cell, goal, tolerance=1e-6))
    starts = domains.inside(cell, 2500)[:1000]
    assert len(starts) == 1000
    streamlines = trace_streamlines(field, starts)
    assert streamlines.arrived.all()
    assert streamlines.times.max() <= 3.0 * np.median(streamlines.times)
    assert all(shapely.contains_xy(cell, *path.T).all() for path in streamlines.paths)


def test_aisles_are_crowded_until_the_shelves_are_cut_free():
    domain, goal = domains.long_shelves(2)
    aisle = np.array([[6.0, 0.6]])
    _, J_closed = HarmonicMap(domain, goal, tolerance=1e-5)(aisle)
    _, J_open = HarmonicMap(cut_open(domain, goal), goal, tolerance=1e-5)(aisle)
    assert abs(np.linalg.det(J_closed[0])) < 1e-8
    assert np.linalg.det(J_open[0]) > 1e-4


@given(floors_with_ends())
@settings(max_examples=40)
def test_nothing_but_strips_is_lost_and_the_widest_passage_stays(floor_with_ends):
    floor, (start, end) = floor_with_ends
    goal = Point(end)
    passage = PassageFinder(floor).find(start, end)
    for cell in (cut_open(floor, goal), cut_open(floor, goal, Point(start))):
        assert cell.is_valid
        assert not cell.interiors
        assert floor.buffer(1e-9).covers(cell)
        assert cell.contains(goal)
        assert floor.difference(cell).buffer(-0.06).is_empty
    assert cell.boundary.distance(passage.path) >= 0.4 * passage.clearance


def test_slits_keep_clear_of_the_widest_passage():
    room = HALL.difference(CRATE)
    passage = PassageFinder(room).find([0.5, 3.2], [5.5, 3.2])
    cell = cut_open(room, Point(5.5, 3.2), Point(0.5, 3.2))
    assert cell.boundary.distance(passage.path) == pytest.approx(passage.clearance)
    assert room.difference(cell).bounds[3] < 1.6


def test_slits_do_not_meet_a_goal_region():
    room = HALL.difference(CRATE)
    goal = box(3.0, 1.8, 4.0, 2.2)
    cell = cut_open(room, goal)
    assert cell.covers(goal)
    assert not cell.interiors
    assert room.difference(cell).distance(goal) > 0.0


def test_a_hole_that_the_goal_encloses_stays():
    room = HALL.difference(CRATE)
    goal = CRATE.buffer(0.3).difference(CRATE)
    assert cut_open(room, goal).equals(room)


def test_a_domain_without_holes_stays_as_it_is():
    assert cut_open(HALL, Point(1, 1)) is HALL


@pytest.mark.parametrize(
    ("domain", "goal", "start", "message"),
    [
        (HALL, Point(7, 1), None, "must lie strictly inside the domain"),
        (HALL, Point(1, 1), Point(9, 9), r"the start POINT \(9 9\) must lie strictly inside"),
        (HALL.difference(CRATE), Point(1, 1), Point(2.5, 2), "the start"),
        (Polygon(), Point(1, 1), None, "got an empty one"),
    ],
)
def test_unusable_questions_are_refused(domain, goal, start, message):
    with pytest.raises(FieldError, match=message):
        cut_open(domain, goal, start)
