"""The signed distance to a polygon's boundary against shapely's."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, box

from coop_drake.errors import GeometryError
from coop_drake.geometry import BoundaryDistance
from tests.support.shapes import floors

ROOM_WITH_PILLAR = box(0, 0, 4, 3).difference(box(1, 1, 2, 2))


def shapely_distance(polygon, points):
    """Signed distance by shapely, positive inside."""
    points = shapely.points(points)
    return shapely.distance(polygon.boundary, points) * np.where(shapely.contains(polygon, points), 1.0, -1.0)


@given(floors(), st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_signed_distance_equals_that_of_shapely(floor, seed):
    x0, y0, x1, y1 = floor.bounds
    points = np.random.default_rng(seed).uniform((x0 - 1, y0 - 1), (x1 + 1, y1 + 1), (200, 2))
    distance = BoundaryDistance(floor)
    expected = shapely_distance(floor, points)
    np.testing.assert_allclose(distance.batch(points), expected, atol=1e-13)
    np.testing.assert_array_equal([distance(point) for point in points], distance.batch(points))


@pytest.mark.parametrize(
    ("point", "expected"),
    [((0.5, 1.5), 0.5), ((1.5, 1.5), -0.5), ((-3.0, -4.0), -5.0), ((1.0, 1.5), 0.0), ((4.0, 3.0), 0.0)],
)
def test_distance_in_a_room_with_a_pillar(point, expected):
    assert BoundaryDistance(ROOM_WITH_PILLAR)(np.array(point)) == pytest.approx(expected, abs=1e-15)


def test_points_level_with_vertices_are_judged_like_the_others():
    diamond = Polygon([(0, -1), (1, 0), (0, 1), (-1, 0)])
    distance = BoundaryDistance(diamond)
    assert distance((0.0, 0.0)) > 0.0
    assert distance((-2.0, 0.0)) < 0.0
    assert distance((2.0, 1.0)) < 0.0


@given(floors(), st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_clearance_along_a_segment_equals_that_of_shapely(floor, seed):
    x0, y0, x1, y1 = floor.bounds
    ends = np.random.default_rng(seed).uniform((x0, y0), (x1, y1), (50, 2, 2))
    distance = BoundaryDistance(floor)
    expected = [floor.boundary.distance(shapely.LineString(pair)) for pair in ends]
    np.testing.assert_allclose(distance.along(ends[:, 0], ends[:, 1]), expected, atol=1e-13)


def test_a_segment_that_is_a_point_has_the_clearance_of_the_point():
    point = np.array([[0.5, 1.5]])
    assert BoundaryDistance(ROOM_WITH_PILLAR).along(point, point) == pytest.approx(0.5)


def test_segments_need_as_many_starts_as_ends():
    with pytest.raises(ValueError, match=r"starts have the shape \(2, 2\), ends the shape \(1, 2\)"):
        BoundaryDistance(ROOM_WITH_PILLAR).along(np.zeros((2, 2)), np.ones((1, 2)))


def test_an_empty_polygon_is_refused():
    with pytest.raises(GeometryError, match="empty polygon has no boundary"):
        BoundaryDistance(Polygon())


def test_edges_of_all_rings_are_kept():
    assert BoundaryDistance(ROOM_WITH_PILLAR).edges.shape == (8, 4)
    assert Point(0.5, 1.5).within(ROOM_WITH_PILLAR)
