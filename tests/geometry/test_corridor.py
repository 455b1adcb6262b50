"""The corridor around a passage: bays go, the passage keeps its clearance."""

import pytest
from hypothesis import given, settings
from shapely import LineString, Point, box

from coop_drake.geometry import BoundaryDistance, PassageFinder
from coop_drake.geometry.tidy import corridor_around
from tests.support.shapes import floors_with_ends


def test_a_bay_beside_an_aisle_goes():
    aisle_with_bay = box(0, 0, 6, 0.4).union(box(2.5, 0, 3.5, 2.0))
    path = LineString([(0.2, 0.2), (5.8, 0.2)])
    corridor = corridor_around(aisle_with_bay, path, 2.0)
    assert corridor.contains(path)
    assert corridor.bounds[3] < 1.2
    assert corridor.intersection(box(0.5, 0, 2.3, 0.4)).area == pytest.approx(1.8 * 0.4, rel=0.01)


def test_a_path_that_stands_still_keeps_a_disc():
    corridor = corridor_around(box(0, 0, 10, 1), LineString([(5, 0.5), (5, 0.5)]), 2.0)
    assert corridor.bounds == pytest.approx((4, 0, 6, 1))


@given(floors_with_ends())
@settings(max_examples=30)
def test_the_passage_keeps_its_clearance(floor_with_ends):
    floor, (start, end) = floor_with_ends
    passage = PassageFinder(floor).find(start, end)
    corridor = corridor_around(floor, passage.path, 2.0)
    assert floor.buffer(1e-9).covers(corridor)
    assert corridor.contains(Point(end))
    assert corridor.exterior.distance(passage.path) >= 0.99 * passage.clearance
    assert BoundaryDistance(corridor)(start) == pytest.approx(BoundaryDistance(floor)(start), rel=1e-9)
