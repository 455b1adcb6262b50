"""Exact plane geometry against the geometry that it must agree with: shapely, and rational arithmetic."""

from fractions import Fraction
from itertools import pairwise
from math import cos, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPoint, Point, Polygon

from coop_drake.checking import plane, regions
from coop_drake.checking.infeasible import _inside
from coop_drake.checking.plane import (
    BITS,
    ONE,
    TURN,
    apart,
    cosine_and_sine,
    difference,
    hull,
    numbers,
)
from coop_drake.checking.regions import FULL, Convex, Region

PLACE = st.tuples(st.integers(-9, 9), st.integers(-9, 9))
PLACES = st.lists(PLACE, min_size=1, max_size=7)
SEGMENT = st.lists(PLACE, min_size=2, max_size=2, unique=True)


@pytest.fixture(autouse=True)
def enough_work():
    plane.work_left[0] = 10**9


def region(*rings):
    return Region([list(ring) for ring in rings])


@given(st.floats(-1e3, 1e3))
def test_sines_and_cosines_are_right_to_a_unit(angle):
    exact = numbers([angle], 1)[0]
    c, s = cosine_and_sine(exact)
    assert abs(c / ONE - cos(angle)) < 1e-13 > abs(s / ONE - sin(angle))
    assert abs(c * c + s * s - ONE * ONE) <= 4 * ONE
    c2, s2 = cosine_and_sine(2 * exact)
    assert abs(c2 * ONE - (c * c - s * s)) <= 8 * ONE
    assert abs(s2 * ONE - 2 * c * s) <= 8 * ONE
    c3, s3 = cosine_and_sine(exact + TURN)
    assert max(abs(c3 - c), abs(s3 - s)) <= 4


def test_a_turn_is_two_pi():
    tau = Fraction("6.283185307179586476925286766559005768394338798750")
    assert 0 <= tau - Fraction(TURN, ONE) < Fraction(1, ONE)


@given(st.floats(-1e6, 1e6))
def test_numbers_are_doubles_to_a_multiple_of_a_unit(value):
    (exact,) = numbers([value], 1)
    assert abs(Fraction(exact, 1 << BITS) - Fraction(value)) <= Fraction(1, 2 << BITS)


@given(PLACES, PLACES, st.integers(0, 4))
def test_sets_are_apart_exactly_if_their_distance_is_larger(first, second, gap):
    distance = MultiPoint(first).convex_hull.distance(MultiPoint(second).convex_hull)
    if abs(distance - gap) > 1e-9 or gap == 0:
        expected = distance > gap
        assert apart(hull(first), hull(second), gap) == expected == apart(hull(second), hull(first), gap)


@given(PLACES, PLACES)
def test_edges_in_order_of_their_directions_bound_all_differences(first, second):
    first, second = hull(first), hull(second)
    found = difference(first, second)
    assert hull(found) == hull((p - x, q - y) for p, q in first for x, y in second)
    assert len(found) <= len(first) + len(second)
    assert area(found) == area(hull(found))


def area(ring):
    """Twice the area that a ring runs around counter-clockwise."""
    return sum(x * q - y * p for (x, y), (p, q) in pairwise([ring[-1], *ring]))


@given(PLACES, PLACES, st.integers(-3, 2))
def test_corners_are_inside_a_piece_by_more_than_a_depth(points, corners, depth):
    """A corner outside may be refused though it is nearer by less than a unit, here a hundredth."""
    points, corners = ([(100 * x, 100 * y) for x, y in places] for places in (points, corners))
    polygon, depth, expected = MultiPoint(corners).convex_hull, 100 * depth, True
    for point in map(Point, points):
        away = polygon.boundary.distance(point) if isinstance(polygon, Polygon) else polygon.distance(point)
        inside = away if isinstance(polygon, Polygon) and polygon.contains(point) else -away
        if abs(inside - depth) < 2.0:
            return
        expected = expected and inside > depth
    assert _inside(hull(corners), points, depth) == expected


@given(SEGMENT, st.lists(PLACE, min_size=3, max_size=7))
def test_the_stretch_in_a_convex_polygon_is_all_of_its_interior(edge, corners):
    ring = hull(corners)
    if len(ring) < 3:
        assert region(ring).stretches(edge) == []
        return
    inside = LineString(edge).intersection(Polygon(ring)).length
    inside = 0.0 if LineString(edge).relate_pattern(Polygon(ring), "F********") else inside
    found = sum(high - low for low, high in region(ring).stretches(edge)) / FULL * LineString(edge).length
    assert found == pytest.approx(inside, abs=1e-9)


@given(SEGMENT, st.lists(PLACE, min_size=1, max_size=7))
@settings(max_examples=300)
def test_a_convex_set_has_the_stretches_of_the_region_in_its_ring(edge, corners):
    ring = hull(corners)
    made, found = region(ring), Convex(ring).stretches(edge)
    lengths = [sum(high - low for low, high in each) for each in (found, made.stretches(edge))]
    assert len(found) <= 1
    assert abs(lengths[0] - lengths[1]) <= 10
    for place in (place for stretch in found for place in stretch):
        x, y = (a * FULL + (b - a) * place for a, b in zip(*edge, strict=True))
        assert made.has_inside(x, y, FULL)
        assert all(off_edge((x, y), side) for side in made.edges)


@given(SEGMENT, st.lists(PLACE, min_size=3, max_size=6), st.lists(PLACE, min_size=3, max_size=5))
@settings(max_examples=200)
def test_stretches_in_a_region_hold_all_points_of_their_parity_that_are_on_no_edge(edge, outer, hole):
    made = region(outer, hole)
    even = Region(made.rings, odd=False)
    inside, outside = made.stretches(edge), even.stretches(edge)
    assert covered(inside + outside) >= FULL - 100
    for odd, stretches in ((True, inside), (False, outside)):
        for low, high in stretches:
            for place in {low, (low + high) // 2, high}:
                x, y = (a * FULL + (b - a) * place for a, b in zip(*edge, strict=True))
                assert made.has_inside(x, y, FULL) == odd
                assert all(off_edge((x, y), side) for side in made.edges)


def covered(stretches):
    return sum(high - low for low, high in stretches) + collinear_allowance(stretches)


def collinear_allowance(stretches):
    """What lies between stretches: single places, or edges on the segment's own line."""
    ends = sorted(stretches)
    gaps = [b[0] - a[1] for a, b in pairwise(ends)]
    return sum(gaps) + (ends[0][0] + FULL - ends[-1][1] if ends else FULL)


def off_edge(point, edge):
    (px, py), (qx, qy) = ((x * FULL, y * FULL) for x, y in edge)
    if edge[0] == edge[1]:
        return point != (px, py)
    across = (qx - px) * (point[1] - py) - (qy - py) * (point[0] - px)
    along = (qx - px) * (point[0] - px) + (qy - py) * (point[1] - py)
    return across != 0 or not 0 <= along <= (qx - px) ** 2 + (qy - py) ** 2


@given(st.lists(PLACE, min_size=3, max_size=5), st.lists(PLACE, min_size=3, max_size=5))
def test_regions_touch_if_they_share_a_point(first, second):
    one, other = region(first), region(second)
    polygons = Polygon(first), Polygon(second)
    if one.edges and other.edges and all(polygon.is_valid for polygon in polygons):
        assert one.touches(other) == polygons[0].intersects(polygons[1]) == other.touches(one)


def test_a_point_beside_a_slanted_edge_lies_inside_though_it_is_in_the_edges_box():
    slanted = region([(0, 0), (9, 0), (9, 9)])
    assert slanted.stretches(((6, 2), (6, 2))) == [(0, FULL)]
    assert slanted.stretches(((2, 2), (2, 2))) == slanted.stretches(((2, 3), (2, 3))) == []


@given(
    st.lists(st.tuples(st.integers(20, 60), st.integers(-9, 9)), min_size=60, max_size=90),
    st.tuples(st.integers(-50, 50), st.integers(-60, 60), st.integers(0, 30), st.integers(0, 30)),
    st.integers(0, 12),
)
def test_edges_near_a_box_are_found_in_squares_as_among_all(offsets, place, gap):
    around = [
        (int(radius * cos(0.1 * k)), int(radius * sin(0.1 * k)) + jump)
        for k, (radius, jump) in enumerate(offsets)
    ]
    many, (x, y, width, height) = region(around), place
    box = x, y, x + width, y + height
    assert len(many.edges) > regions.MANY
    near = [k for k, its in enumerate(many.boxes) if not plane.boxes_apart(its, box, gap)]
    assert sorted(many.near(box, gap)) == near
    assert sum(map(len, many.squares[1].values())) <= 7 * len(many.edges)


def test_a_point_is_inside_a_region_of_many_edges_as_in_shapely():
    star = [(round((40 + 30 * (k % 2)) * cos(k / 16)), round(70 * sin(k / 16))) for k in range(100)]
    many, shape = region(star), Polygon(star)
    for x in range(-70, 71, 7):
        for y in range(-73, 74, 7):
            if not shape.boundary.intersects(Point(x + 0.5, y + 0.5)):
                assert many.has_inside(2 * x + 1, 2 * y + 1, 2) == shape.buffer(0).contains(
                    Point(x + 0.5, y + 0.5)
                )
