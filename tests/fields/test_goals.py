"""Which goals collapse, which are reached through their pole, which questions are refused."""

import numpy as np
import pytest
from shapely import MultiPolygon, Point, Polygon, affinity, box

from coop_drake.errors import FieldError
from coop_drake.fields import HarmonicMap, VelocityField, trace_streamlines
from coop_drake.fields.goals import region_to_map
from tests.support import domains

ROOM = box(0, 0, 4, 2)
CRATE = box(1.5, 0.7, 2.5, 1.3)
WITH_CRATE = ROOM.difference(CRATE)
FRAME = box(0.5, 0.2, 3.5, 1.8).difference(box(1, 0.6, 3, 1.4))
POSTS = box(1.9, 0.5, 2.1, 0.7).union(box(1.9, 1.3, 2.1, 1.5))

COLLAPSING = {
    "in the interior": (ROOM, box(2.5, 0.5, 3.3, 1.2), None),
    "one arc of the ring": (ROOM, box(3, 1.5, 4, 2), None),
    "around a corner": (ROOM, box(3, 0, 4, 2).union(box(0, 1.5, 4, 2)), None),
    "a splitting one": (ROOM, box(1.5, 0, 2, 2), Point(0.5, 1)),
    "all round a hole": (WITH_CRATE, CRATE.buffer(0.3).difference(CRATE), None),
    "a frame from outside": (ROOM, FRAME, Point(0.2, 1)),
    "a millimetre large": (
        affinity.scale(ROOM, 1e-3, 1e-3, origin=(0, 0)),
        affinity.scale(box(3, 1.5, 4, 2), 1e-3, 1e-3, origin=(0, 0)),
        None,
    ),
}
THROUGH_THE_POLE = {
    "touching in a point": (ROOM, Polygon([(2, 0), (2.5, 0.5), (1.5, 0.5)]), None),
    "tangent to the wall": (ROOM, Point(2, 0.5).buffer(0.5, quad_segs=16), None),
    "a hair off the wall": (ROOM, box(2, 1e-5, 3, 1), None),
    "a frame from inside": (ROOM, FRAME, Point(1.5, 1)),
    "two arcs": (ROOM.difference(POSTS), FRAME.difference(POSTS), Point(1.5, 1)),
    "part of a hole": (WITH_CRATE, box(2.5, 0.8, 3, 1.2), None),
    "a hole and the wall": (WITH_CRATE, box(1.8, 1.3, 2.2, 2), None),
    "a hole's corner": (WITH_CRATE, Polygon([(2.5, 0.7), (3, 0.3), (3, 0.7)]), None),
    "the whole domain": (ROOM, ROOM, None),
    "a start within it": (ROOM, box(1, 0, 2, 2), Point(1.5, 1)),
    "a cusp against the wall": (ROOM, Polygon([(1, 0.04), (4, 0), (4, 1), (2, 1)]), None),
}


@pytest.mark.parametrize("name", COLLAPSING)
def test_a_goal_clear_of_walls_or_on_one_arc_collapses(name):
    domain, goal, inside = COLLAPSING[name]
    region, target = region_to_map(domain, goal, inside)
    assert target is goal
    assert region.intersection(goal).area == pytest.approx(0.0, abs=1e-9 * domain.area)
    harmonic_map = HarmonicMap(domain, goal, inside=inside, tolerance=1e-6)
    shared = region.exterior.intersection(goal.exterior).length > 0.0
    assert np.hypot(*harmonic_map.goal_image) <= 1.0 + 1e-12
    assert bool(np.hypot(*harmonic_map.goal_image) > 1.0 - 1e-9) is shared


@pytest.mark.parametrize("name", [*COLLAPSING, *THROUGH_THE_POLE])
def test_every_goal_is_reached(name):
    domain, goal, inside = {**COLLAPSING, **THROUGH_THE_POLE}[name]
    harmonic_map = HarmonicMap(domain, goal, inside=inside, tolerance=1e-6)
    starts = domains.inside(harmonic_map.region, 60)
    streamlines = trace_streamlines(VelocityField(harmonic_map), starts)
    assert len(starts) > 10
    assert streamlines.arrived.all()
    assert max(goal.distance(Point(path[-1])) for path in streamlines.paths) < 0.01 * np.sqrt(goal.area)


@pytest.mark.parametrize("name", THROUGH_THE_POLE)
def test_any_other_goal_is_reached_through_its_pole(name):
    domain, goal, inside = THROUGH_THE_POLE[name]
    region, target = region_to_map(domain, goal, inside)
    assert region is domain
    assert goal.contains(target)
    harmonic_map = HarmonicMap(domain, goal, inside=inside, tolerance=1e-6)
    np.testing.assert_array_equal(harmonic_map.goal_image, harmonic_map(target.coords[0])[0])


@pytest.mark.parametrize(
    ("domain", "goal", "inside", "message"),
    [
        (ROOM, Point(5, 1), None, "must lie strictly inside the domain, which spans x 0 to 4"),
        (ROOM, Point(4, 1), None, "must lie strictly inside the domain"),
        (ROOM, Point(np.nan, 1), None, "must lie strictly inside the domain"),
        (ROOM, Point(), None, "must lie strictly inside the domain"),
        (WITH_CRATE, Point(2, 1), None, "may have holes"),
        (ROOM, box(3, 0, 5, 2), None, "goal region must lie in the domain; intersect it"),
        (ROOM, Polygon(), None, "the goal region must be one valid polygon with an area, got an empty one"),
        (ROOM, (1.0, 1.0), None, "must be a shapely Point or Polygon, got tuple"),
        (ROOM, MultiPolygon([box(0, 0, 1, 1), box(2, 0, 3, 1)]), None, "got MultiPolygon; take one of its"),
        ([(0, 0), (1, 0), (0, 1)], Point(0.2, 0.2), None, "the domain must be a shapely Polygon, got list"),
        (Polygon(), Point(0, 0), None, "the domain must be one valid polygon with an area, got an empty"),
        (Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), Point(0.5, 0.2), None, "Self-intersection"),
        (ROOM, box(1, 0, 2, 2), None, "splits the domain into 2 pieces: the argument `inside`"),
        (ROOM, box(1, 0, 2, 2), Point(5, 1), r"`inside`, POINT \(5 1\), is outside the domain"),
    ],
)
def test_unusable_questions_are_refused(domain, goal, inside, message):
    with pytest.raises(FieldError, match=message):
        HarmonicMap(domain, goal, inside=inside)


@pytest.mark.filterwarnings("ignore:invalid value encountered")
def test_a_coordinate_that_is_no_number_is_refused():
    with pytest.raises(FieldError, match="Invalid Coordinate"):
        HarmonicMap(Polygon([(0, 0), (1, 0), (np.nan, 1)]), Point(0.2, 0.2))


def test_inside_selects_the_piece_of_a_split_domain():
    goal = box(1, 0, 2, 2)
    assert region_to_map(ROOM, goal, Point(0.5, 1))[0].area == pytest.approx(2)
    assert region_to_map(ROOM, goal, Point(3, 1))[0].area == pytest.approx(4)


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
