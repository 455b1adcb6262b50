"""Polygons: distances to the boundary, widest passages, simplified and tidy regions, triangulations."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Point, Polygon, box

from coop_drake.errors import GeometryError
from coop_drake.geometry import (
    BoundaryDistance,
    PassageFinder,
    pole,
    sharpest_angle,
    simplify_inward,
    tidy_cell,
)
from coop_drake.geometry.passage import triangulate
from tests.support.channels import untidy_cell
from tests.support.shapes import floors, floors_with_ends

# The signed distance to a polygon's boundary against shapely's.

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


def test_segments_need_as_many_starts_as_ends():
    with pytest.raises(ValueError, match=r"starts have the shape \(2, 2\), ends the shape \(1, 2\)"):
        BoundaryDistance(ROOM_WITH_PILLAR).along(np.zeros((2, 2)), np.ones((1, 2)))


def test_an_empty_polygon_is_refused():
    with pytest.raises(GeometryError, match="empty polygon has no boundary"):
        BoundaryDistance(Polygon())


# Widest passages: known clearances, and what must hold on any floor.

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


def test_ends_outside_and_ends_in_different_places_are_refused():
    with pytest.raises(GeometryError, match="must lie inside"):
        PassageFinder(box(0, 0, 1, 1)).find((0.5, 0.5), (1.5, 0.5))
    pinched = Polygon([(0, 0), (1, 0.5), (2, 0), (2, 1), (1, 0.5 + 1e-12), (0, 1)])
    with pytest.raises(GeometryError, match="no passage joins"):
        PassageFinder(pinched).find((0.2, 0.5), (1.8, 0.5))


def test_a_polygon_without_area_has_no_pole():
    with pytest.raises(GeometryError, match="without area"):
        pole(Polygon())


# Inward simplification: fewer vertices, nothing gained, little lost.


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


# Tidy cells: inside the safe region, without holes, fit for a map, with the passage kept.

ENDS = [np.array([0.5, 0.4]), np.array([3.9, 0.4])]


def edge_lengths(polygon):
    return np.linalg.norm(np.diff(shapely.get_coordinates(polygon.exterior), axis=0), axis=1)


def test_cusps_slivers_idle_vertices_and_pillars_go_and_the_clearance_stays():
    safe = untidy_cell()
    tidied = tidy_cell(safe, ENDS)
    assert not tidied.interiors
    assert len(edge_lengths(tidied)) < 25
    assert edge_lengths(tidied).min() > 0.005
    assert np.degrees(sharpest_angle(safe)) < 5.0
    assert np.degrees(sharpest_angle(tidied)) > 45.0
    clearance = PassageFinder(safe).find(*ENDS).clearance
    assert PassageFinder(tidied).find(*ENDS).clearance >= 0.8 * clearance


@given(floors_with_ends())
@settings(max_examples=60)
def test_a_tidy_cell_is_inside_whole_and_joins_the_ends(floor_with_ends):
    safe, ends = floor_with_ends
    tidied = tidy_cell(safe, ends)
    assert safe.covers(tidied)
    assert tidied.is_valid
    assert not tidied.interiors
    for end in ends:
        assert BoundaryDistance(tidied)(end) > 0.0
    assert PassageFinder(tidied).find(*ends).clearance >= 0.79 * PassageFinder(safe).find(*ends).clearance


def test_a_region_whose_grown_boundary_crosses_itself_is_tidied():
    # Shrunk and grown again with mitred corners, it gets a boundary that GEOS does not intersect.
    corners = [(0.46759, 0.06659), (0.41756, 0.0204), (0.0825, 0.38319), (0.05462, 0.46106)]
    safe = Polygon([*corners, (0.05344, 0.46232), (0.05394, 0.4628), (0.01733, 0.55409)])
    place = 0.28, 0.218
    cell = tidy_cell(safe, [place, place])
    assert safe.contains(cell)
    assert BoundaryDistance(cell)(place) > 0.8 * BoundaryDistance(safe)(place)


def test_a_point_outside_the_safe_region_is_refused():
    with pytest.raises(GeometryError, match="holds no path"):
        tidy_cell(box(0, 0, 1, 1), [np.array([2.0, 2.0])])


def test_points_in_different_rooms_are_refused():
    rooms = box(0, 0, 2, 1).difference(box(0.9, -1, 1.1, 2).difference(Point(1, 0.5).buffer(1e-7)))
    with pytest.raises(GeometryError):
        tidy_cell(max(rooms.geoms, key=lambda part: part.area), [np.array([0.5, 0.5]), np.array([1.5, 0.5])])


# A triangulation of a polygon between points of its rings.

HALL = box(0, 0, 6, 4)
TWO_CRATES = HALL.difference(box(1, 1, 2, 3)).difference(box(2.2, 1, 3, 3))


@given(floors_with_ends())
@settings(max_examples=20)
def test_triangles_fill_the_polygon_and_their_diagonals_join_them(floor_with_ends):
    floor, _ = floor_with_ends
    mesh = triangulate(floor)
    triangles = shapely.polygons(mesh.vertices[mesh.corners])
    assert shapely.area(triangles).sum() == pytest.approx(floor.area)
    # Euler: every hole adds one diagonal to those of a tree of triangles, unless it touches another ring.
    apart = shapely.get_num_geometries(floor.boundary.buffer(1e-6))
    assert len(mesh.diagonals) == len(mesh.corners) - 1 + (apart - 1)
    for ends, sides in zip(mesh.diagonals, mesh.neighbours, strict=True):
        assert all(set(ends) <= set(mesh.corners[t]) for t in sides)
    for ring, shape in enumerate((floor.exterior, *floor.interiors)):
        on_ring = shapely.points(mesh.vertices[mesh.ring == ring])
        assert shapely.distance(shape, on_ring).max() < 1e-9


def test_pieces_are_short_where_the_opposite_wall_is_near():
    mesh = triangulate(TWO_CRATES)
    facing = mesh.vertices[(mesh.ring == 1) & (mesh.vertices[:, 0] == 2.0)]
    assert np.diff(np.sort(facing[:, 1])).max() <= 0.2
    across = shapely.LineString([(2, 2), (2.2, 2)])
    lines = shapely.linestrings(mesh.vertices[mesh.diagonals])
    crossing = lines[(mesh.ring[mesh.diagonals] == [1, 2]).all(axis=1)]
    assert shapely.length(crossing).min() == pytest.approx(across.length)


def test_repeated_points_do_no_harm():
    doubled = shapely.Polygon([(0, 0), (2, 0), (2, 0), (2, 1), (0, 1), (0, 1)])
    mesh = triangulate(doubled)
    assert shapely.area(shapely.polygons(mesh.vertices[mesh.corners])).sum() == pytest.approx(2.0)
