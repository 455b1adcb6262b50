"""Which goals collapse, which are reached through their pole, which questions are refused."""

import numpy as np
import pytest
from shapely import MultiPolygon, Point, Polygon, affinity, box

from coop_drake.errors import FieldError, UnmappableError
from coop_drake.harmonic_maps import HarmonicMap, VelocityField, trace_streamlines
from coop_drake.harmonic_maps.outline import outline_of, region_to_map
from tests.support import domains

ROOM = box(0, 0, 4, 2)


def outline(domain, goal):
    return outline_of(*region_to_map(domain, goal))


def test_angles_are_linear_in_arc_length():
    o = outline(ROOM, Point(1, 1))
    length = np.abs(o.ends - o.vertices)
    np.testing.assert_allclose(o.angle_end - o.angle_start, 2 * np.pi * length / 12.0)
    np.testing.assert_allclose(o.corner_angles, np.pi / 2)
    assert o.goal_ring is None
    assert o.goal_angle is None


def test_domain_lies_left_of_every_ring():
    ring_with_hole = ROOM.difference(box(1, 0.5, 2, 1.5))
    o = outline(ring_with_hole, Point(3, 1))
    areas = [0.5 * np.sum(np.imag(np.conj(o.vertices) * o.ends)[o.ring == k]) for k in range(o.holes + 1)]
    np.testing.assert_allclose(areas, [8.0, -1.0])
    np.testing.assert_allclose(o.corner_angles[o.ring == 1], 1.5 * np.pi)


def test_repeated_and_collinear_vertices_are_dropped():
    noisy = Polygon([(0, 0), (1, 0), (1 + 1e-13, 0), (2, 0), (4, 0), (4, 2), (0, 2), (0, 1)])
    assert len(outline(noisy, Point(1, 1)).vertices) == 4


def test_goal_on_the_outer_ring_gets_no_angle():
    o = outline(ROOM, box(3, 0, 4, 2))
    span = o.angle_end - o.angle_start
    arc = np.isclose(o.vertices.real + o.centre.real, 3) & np.isclose(o.ends.real + o.centre.real, 3)
    assert arc.sum() == 1
    assert span[arc] == 0.0
    assert span.sum() == pytest.approx(2 * np.pi)
    assert o.goal_angle == o.angle_start[arc]


def test_ends_of_a_collinear_goal_arc_stay_vertices():
    # The goal hangs on the wall by a strip as thin as nothing: its arc lies along the wall's line.
    bay = ROOM.union(box(1, 2, 2, 3))
    o = outline(bay, box(1, 2, 2, 3))
    assert len(o.vertices) == 6


def test_interior_goal_is_a_hole():
    o = outline(ROOM.difference(box(0.2, 0.2, 0.6, 0.6)), box(2, 0.5, 3, 1.5))
    assert o.holes == 2
    assert o.goal_ring is not None
    hole = o.vertices[o.ring == o.goal_ring] + o.centre
    assert hole.real.min() == pytest.approx(2)


def test_rings_that_touch_are_refused_with_their_place():
    touching = ROOM.difference(Polygon([(2, 0), (2.5, 0.5), (1.5, 0.5)]))
    with pytest.raises(UnmappableError, match=r"touches another at \(2, 0\) m") as caught:
        outline(touching, Point(1, 1))
    assert caught.value.place == (2.0, 0.0)
    assert caught.value.width == 0.0
    assert caught.value.angle is None


@pytest.mark.parametrize("shape", [domains.needle(0.9), domains.blade(359.1)], ids=["needle", "blade"])
def test_corners_sharper_than_a_degree_are_refused_with_their_angle(shape):
    domain, goal = shape
    with pytest.raises(UnmappableError, match="has an interior angle of") as caught:
        outline(domain, goal)
    assert min(caught.value.angle, 360 - caught.value.angle) == pytest.approx(0.9)
    assert Point(caught.value.place).distance(domain.boundary) < 1e-9
    assert caught.value.width is None


CRATE = box(1.5, 0.7, 2.5, 1.3)
WITH_CRATE = ROOM.difference(CRATE)
FRAME = box(0.5, 0.2, 3.5, 1.8).difference(box(1, 0.6, 3, 1.4))
POSTS = box(1.9, 0.5, 2.1, 0.7).union(box(1.9, 1.3, 2.1, 1.5))

COLLAPSING = {
    "in the interior": (ROOM, box(2.5, 0.5, 3.3, 1.2)),
    "one arc of the ring": (ROOM, box(3, 1.5, 4, 2)),
    "around a corner": (ROOM, box(3, 0, 4, 2).union(box(0, 1.5, 4, 2))),
    "all round a hole": (WITH_CRATE, CRATE.buffer(0.3).difference(CRATE)),
    "a millimetre large": tuple(
        affinity.scale(shape, 1e-3, 1e-3, origin=(0, 0)) for shape in (ROOM, box(3, 1.5, 4, 2))
    ),
}
THROUGH_THE_POLE = {
    "touching in a point": (ROOM, Polygon([(2, 0), (2.5, 0.5), (1.5, 0.5)])),
    "tangent to the wall": (ROOM, Point(2, 0.5).buffer(0.5, quad_segs=16)),
    "a hair off the wall": (ROOM, box(2, 1e-5, 3, 1)),
    "a frame": (ROOM, FRAME),
    "two arcs": (ROOM.difference(POSTS), FRAME.difference(POSTS)),
    "part of a hole": (WITH_CRATE, box(2.5, 0.8, 3, 1.2)),
    "a hole and the wall": (WITH_CRATE, box(1.8, 1.3, 2.2, 2)),
    "a hole's corner": (WITH_CRATE, Polygon([(2.5, 0.7), (3, 0.3), (3, 0.7)])),
    "the whole domain": (ROOM, ROOM),
    "a splitting one": (ROOM, box(1, 0, 2, 2)),
    "a cusp against the wall": (ROOM, Polygon([(1, 0.04), (4, 0), (4, 1), (2, 1)])),
}


@pytest.mark.parametrize("name", COLLAPSING)
def test_a_goal_clear_of_walls_or_on_one_arc_collapses(name):
    domain, goal = COLLAPSING[name]
    region, target = region_to_map(domain, goal)
    assert target is goal
    assert region.intersection(goal).area == pytest.approx(0.0, abs=1e-9 * domain.area)
    harmonic_map = HarmonicMap(domain, goal, tolerance=1e-6)
    shared = region.exterior.intersection(goal.exterior).length > 0.0
    assert np.hypot(*harmonic_map.goal_image) <= 1.0 + 1e-12
    assert bool(np.hypot(*harmonic_map.goal_image) > 1.0 - 1e-9) is shared


@pytest.mark.parametrize("name", [*COLLAPSING, *THROUGH_THE_POLE])
def test_every_goal_is_reached(name):
    domain, goal = {**COLLAPSING, **THROUGH_THE_POLE}[name]
    harmonic_map = HarmonicMap(domain, goal, tolerance=1e-6)
    starts = domains.inside(harmonic_map.region, 60)
    streamlines = trace_streamlines(VelocityField(harmonic_map), starts)
    assert len(starts) > 10
    assert streamlines.arrived.all()
    assert max(goal.distance(Point(path[-1])) for path in streamlines.paths) < 0.01 * np.sqrt(goal.area)


@pytest.mark.parametrize("name", THROUGH_THE_POLE)
def test_any_other_goal_is_reached_through_its_pole(name):
    domain, goal = THROUGH_THE_POLE[name]
    region, target = region_to_map(domain, goal)
    assert region is domain
    assert goal.contains(target)
    harmonic_map = HarmonicMap(domain, goal, tolerance=1e-6)
    np.testing.assert_array_equal(harmonic_map.goal_image, harmonic_map(target.coords[0])[0])


@pytest.mark.parametrize(
    ("domain", "goal", "message"),
    [
        (ROOM, Point(5, 1), "must lie strictly inside the domain, which spans x 0 to 4"),
        (ROOM, Point(4, 1), "must lie strictly inside the domain"),
        (ROOM, Point(np.nan, 1), "must lie strictly inside the domain"),
        (ROOM, Point(), "must lie strictly inside the domain"),
        (WITH_CRATE, Point(2, 1), "may have holes"),
        (ROOM, box(3, 0, 5, 2), "goal region must lie in the domain; intersect it"),
        (ROOM, Polygon(), "the goal region must be one valid polygon with an area, got an empty one"),
        (ROOM, (1.0, 1.0), "must be a shapely Point or Polygon, got tuple"),
        (ROOM, MultiPolygon([box(0, 0, 1, 1), box(2, 0, 3, 1)]), "got MultiPolygon; take one of its"),
        ([(0, 0), (1, 0), (0, 1)], Point(0.2, 0.2), "the domain must be a shapely Polygon, got list"),
        (Polygon(), Point(0, 0), "the domain must be one valid polygon with an area, got an empty"),
        (Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), Point(0.5, 0.2), "Self-intersection"),
    ],
)
def test_unusable_questions_are_refused(domain, goal, message):
    with pytest.raises(FieldError, match=message):
        HarmonicMap(domain, goal)


@pytest.mark.filterwarnings("ignore:invalid value encountered")
def test_a_coordinate_that_is_no_number_is_refused():
    with pytest.raises(FieldError, match="Invalid Coordinate"):
        HarmonicMap(Polygon([(0, 0), (1, 0), (np.nan, 1)]), Point(0.2, 0.2))


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([1.0, 2.0, 3.0], r"must have shape \(..., 2\), got \(3,\)"),
        (1.0, r"must have shape \(..., 2\), got \(\)"),
        ([[0.1, 0.2], [np.nan, 0.2]], r"must be finite, but point \[1\] is \[nan, 0.2\]"),
        ([np.inf, 0.2], "must be finite"),
        ("here", "must be numbers"),
    ],
)
def test_points_of_wrong_shape_are_refused(points, message):
    with pytest.raises(FieldError, match=message):
        HarmonicMap(*domains.square())(points)


def test_edges_as_short_as_rounding_are_left_out_inward():
    kinked = Polygon([(0, 0), (1, 0), (1 + 7e-9, 7e-9), (2, 1), (1 + 3e-9, 2), (1, 2), (0, 1 + 1e-8), (0, 1)])
    region, _ = region_to_map(kinked, Point(0.5, 0.5))
    assert len(region.exterior.coords) == 6
    assert kinked.buffer(1e-15).covers(region)
    assert kinked.difference(region).area < 1e-7
    assert HarmonicMap(kinked, Point(0.5, 0.5), tolerance=1e-8).accuracy.error_estimate <= 1e-8


def test_a_third_coordinate_does_no_harm():
    raised = Polygon([(0, 0, 3), (4, 0, 3), (4, 2, 3), (0, 2, 3)])
    here, there = HarmonicMap(raised, Point(3, 1, 3)), HarmonicMap(ROOM, Point(3, 1))
    assert np.hypot(*here.goal_image) == pytest.approx(np.hypot(*there.goal_image))
    assert np.isfinite(VelocityField(here)([0.5, 0.5])).all()


def test_edges_of_a_micrometre_are_kept():
    domain, goal = domains.bevelled(1e-6)
    assert region_to_map(domain, goal)[0] is domain
