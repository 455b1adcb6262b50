"""Inward simplification: fewer vertices, nothing gained, little lost."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, box

from coop_drake.geometry import sharpest_angle, simplify_inward
from coop_drake.geometry.simplify import vertex_angles
from tests.support.shapes import floors


def vertices(polygon):
    return len(shapely.get_coordinates(polygon)) - 1 - len(polygon.interiors)


@given(floors(), st.floats(1e-4, 0.05))
@settings(max_examples=80)
def test_nothing_is_gained_and_no_more_than_the_tolerance_is_lost(floor, tolerance):
    simple = simplify_inward(floor, tolerance)
    assert simple.is_valid
    assert simple.area > 0.0
    assert floor.buffer(1e-9).covers(simple)
    assert vertices(simple) <= vertices(floor)
    depth = shapely.distance(simple, shapely.points(shapely.get_coordinates(floor)))
    assert depth.max() <= tolerance + 1e-9


def test_idle_vertices_on_straight_walls_go():
    room = shapely.segmentize(box(0, 0, 3, 2), 0.01)
    assert vertices(simplify_inward(room, 1e-6, slack=1e-9)) == 4


def test_a_round_pillar_becomes_a_polygon_around_it():
    pillar = Point(1, 1).buffer(0.3)
    room = box(0, 0, 2, 2).difference(pillar)
    simple = simplify_inward(room, 0.02)
    assert vertices(simple) <= vertices(room) / 3
    assert Polygon(simple.interiors[0]).buffer(1e-9).covers(pillar)
    assert Polygon(simple.interiors[0]).area < 1.15 * pillar.area


def test_a_deeper_bay_than_the_tolerance_stays():
    room = box(0, 0, 3, 2).union(box(1, 1.9, 1.5, 2.1))
    assert simplify_inward(room, 0.05).equals(room)
    assert vertices(simplify_inward(room, 0.15)) < vertices(room)


def test_a_corner_is_not_cut_through_a_wall_that_stands_in_it():
    spike = Polygon([(0.05, 0.05), (1.0, 0.9), (0.9, 1.0)])
    bay = Polygon([(0, 0), (0.2, 0), (2, 1), (2, 2), (1, 2), (0, 0.2)]).difference(spike)
    simple = simplify_inward(bay, 0.1)
    assert simple.is_valid
    assert bay.buffer(1e-9).covers(simple)


@pytest.mark.parametrize(
    ("polygon", "expected"),
    [
        (box(0, 0, 1, 1), 90.0),
        (Polygon([(0, 0), (1, 0), (0, 1)]), 45.0),
        (box(0, 0, 4, 4).difference(Polygon([(1, 1), (3, 1), (2, 3)])), np.degrees(2 * np.arctan2(1, 2))),
    ],
)
def test_sharpest_angle_counts_corners_of_the_room_and_of_pillars(polygon, expected):
    assert np.degrees(sharpest_angle(polygon)) == pytest.approx(expected)


def test_interior_angles_add_up():
    room = box(0, 0, 4, 4).difference(box(1, 1, 2, 2))
    np.testing.assert_allclose(np.sort(vertex_angles(room)), [np.pi / 2] * 4 + [3 * np.pi / 2] * 4)
