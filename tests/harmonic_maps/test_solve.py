"""Solving maps to their tolerance, and the store that keeps them."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
import pytest
from shapely import MultiPolygon, Point, Polygon, affinity, box, union_all

from coop_drake.errors import FieldError
from coop_drake.harmonic_maps import HarmonicMap, MapStore, VelocityField, solve, trace_streamlines
from coop_drake.harmonic_maps.evaluate import (
    ON_BOUNDARY,
    evaluate_many,
    flatten,
)
from coop_drake.harmonic_maps.field import velocity_in_field
from coop_drake.harmonic_maps.outline import outline_of, region_to_map
from coop_drake.harmonic_maps.panels import corner_operator, lay_panels, leg_panels, panel_nodes
from coop_drake.harmonic_maps.solve import solve_density
from tests.support import domains

# The compressed corner beside a finely graded one.


def wedge_kernel(angle, target, source, weight):
    s, t = target[:, None], source[None, :]
    return s * np.sin(angle) / np.pi / (s * s + t * t - 2 * np.cos(angle) * s * t) * weight


def graded_breaks(levels, parts):
    rings = [2.0**-k * (0.5 + 0.5 * np.arange(parts + 1) / parts) for k in range(levels, -1, -1)]
    return np.concatenate([[0.0], *[ring[:-1] for ring in rings], [1.0]])


@pytest.mark.parametrize("degrees", [20.0, 75.0, 135.0, 200.0, 315.0, 345.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_compressed_corner_acts_like_a_finely_graded_one(degrees, sign):
    angle = np.deg2rad(degrees)
    gap = min(angle, 2 * np.pi - angle)
    x, w = panel_nodes(graded_breaks(64, int(np.ceil(1.0 / np.sin(min(gap, np.pi / 2))))), 8)
    incoming = np.cos
    density = np.linalg.solve(np.eye(len(x)) + sign * wedge_kernel(angle, x, x, w), incoming(x))
    seen_from_afar = np.sum(w * density / (x + 1.5))

    operator = corner_operator(angle, 12, 1.5)
    x_leg, w_leg = panel_nodes(leg_panels(angle, 1.5)[0], 12)
    compressed = operator.compressed[0 if sign > 0 else 1] @ incoming(x_leg)
    assert np.sum(w_leg * compressed / (x_leg + 1.5)) == pytest.approx(seen_from_afar, abs=2e-9)


# Compressed systems have the solution of dense ones.

SHELVES = box(0, 0, 4, 3).difference(union_all([box(0.5, 0.5, 1.5, 1), box(2, 0.6, 3.4, 2.2).buffer(-0.1)]))


def density_of(domain, goal, nodes=10):
    outline = outline_of(domain, goal)
    return solve_density(outline, lay_panels(outline, 1.5), np.round(outline.corner_angles, 12), nodes, 1.5)


@pytest.mark.parametrize(
    ("domain", "goal"),
    [domains.maze(4), (SHELVES, Point(3.7, 2.6)), domains.rounded_room(), domains.needle(8)],
    ids=["maze", "shelves", "rounded", "needle"],
)
def test_compressed_systems_have_the_same_solution(domain, goal, monkeypatch):
    dense = density_of(domain, goal)
    monkeypatch.setattr(solve, "DENSE", 150)
    monkeypatch.setattr(solve, "_LEAF", 60)
    compressed = density_of(domain, goal)
    np.testing.assert_allclose(compressed.hole_images, dense.hole_images, atol=1e-9)
    # On holes the densities differ by the gauge's constant.
    outer = outline_of(domain, goal).ring[dense.nodes.edge] == 0
    np.testing.assert_allclose(compressed.weighted[outer], dense.weighted[outer], atol=1e-9)


# A map as one array: nothing is lost, compiled code sees what Python sees, series equal sums over all.


@numba.njit
def as_a_kernel_calls_it(flat, field, x, y):
    return velocity_in_field(flat, field, x, y)


@pytest.fixture(scope="module")
def moved_map():
    domain, goal = (affinity.translate(shape, 100.0, -40.0) for shape in domains.warehouse())
    return HarmonicMap(domain, goal)


def test_one_point_gets_what_it_gets_among_many(moved_map):
    points = domains.inside(moved_map.region, 50)
    T, J = moved_map(points)
    for k, point in enumerate(points):
        one_T, one_J = moved_map(point)
        np.testing.assert_array_equal(one_T, T[k])
        np.testing.assert_array_equal(one_J, J[k])


@pytest.mark.parametrize("goal", [Point(107.0, -35.0), box(107.4, -35.0, 108.0, -34.4)])
def test_compiled_code_evaluates_a_field_by_itself(goal):
    room = box(100.0, -40.0, 108.0, -34.0)
    field = VelocityField(HarmonicMap(room, goal), 0.7)

    for point in domains.inside(room, 20):
        seen = as_a_kernel_calls_it(*field.kernel_arguments, *point)
        # To the last bit: sums are added in one order, into whatever function they are compiled.
        np.testing.assert_array_equal(seen, tuple(field(point)))


DOMAINS = {
    "warehouse": domains.warehouse(),
    "rounded": domains.rounded_room(),
    "needle": domains.needle(10),
    "slit": (box(0, 0, 2, 1).difference(box(0.9, 0.2, 0.92, 1.5)), Point(1.7, 0.5)),
}


@pytest.fixture(scope="module", params=DOMAINS)
def mapped(request):
    return HarmonicMap(*DOMAINS[request.param])


def without_boxes(arrays):
    """The same map in one box, to which every panel and every corner is near."""
    panels, corners = len(arrays.panels), len(arrays.corners)
    near = np.zeros((panels + corners, 3), dtype=np.int64)
    near[:panels, 0], near[:panels, 1] = -1, np.arange(panels)
    near[panels:, 0], near[panels:, 1] = np.arange(corners), -1
    return arrays._replace(
        boxes=np.array([-1]),
        leaf_square=np.array([[*arrays.root[:2], np.sqrt(2.0) * arrays.root[2]]]),
        leaf_state=np.array([ON_BOUNDARY]),
        local=np.zeros((1, *arrays.local.shape[1:])),
        near_start=np.array([0, len(near)]),
        near=near,
    )


def test_series_change_nothing(mapped):
    flat, centre = mapped.solution.flat, mapped.solution.centre
    alone = flatten(without_boxes(mapped.solution.arrays), centre, flat[2])
    walls, normals = domains.off_wall(mapped.region, 0.0)
    points = np.concatenate((domains.inside(mapped.region, 400), walls, walls + 1e-4 * normals)) - centre
    T, J = evaluate_many(flat, points)
    T_all, J_all = evaluate_many(alone, points)
    # Far panels act through the solved nodes or the refined ones: they agree as well as the map is accurate.
    np.testing.assert_allclose(T, T_all, atol=mapped.accuracy.error_estimate + 1e-11)
    np.testing.assert_allclose(J, J_all, atol=1e-6 * np.abs(J_all).max())


@pytest.mark.slow
def test_sharp_corners_of_many_nodes_fit():
    domain, goal = domains.needle(1.05)
    harmonic_map = HarmonicMap(domain, goal)
    assert harmonic_map.solution.arrays.corner_index[:-1, 2].max() > 512
    T, J = harmonic_map(domains.inside(domain, 100))
    assert (np.hypot(*T.T) < 1.0).all()
    assert (np.linalg.det(J) > 0.0).all()


# Which goals collapse, which are reached through their pole, which questions are refused.

ROOM = box(0, 0, 4, 2)


def outline(domain, goal):
    return outline_of(*region_to_map(domain, goal))


def test_ends_of_a_collinear_goal_arc_stay_vertices():
    # The goal hangs on the wall by a strip as thin as nothing: its arc lies along the wall's line.
    bay = ROOM.union(box(1, 2, 2, 3))
    o = outline(bay, box(1, 2, 2, 3))
    assert len(o.vertices) == 6


def test_rings_that_touch_are_refused_with_their_place():
    touching = ROOM.difference(Polygon([(2, 0), (2.5, 0.5), (1.5, 0.5)]))
    with pytest.raises(FieldError, match=r"touches another at \(2, 0\) m"):
        outline(touching, Point(1, 1))


@pytest.mark.parametrize("shape", [domains.needle(0.9), domains.blade(359.1)], ids=["needle", "blade"])
def test_corners_sharper_than_a_degree_are_refused_with_their_angle(shape):
    domain, goal = shape
    with pytest.raises(FieldError, match=r"corner at \(.*\) m has an interior angle of (0\.9|359)"):
        outline(domain, goal)


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


# Maps kept on disk: the same to the last bit, never stale, never in the way.


TOLERANCE = 1e-7


@pytest.fixture
def store(tmp_path):
    return MapStore(tmp_path / "maps")


def same(one, other):
    """Whether two maps agree bit by bit in everything that can be asked of them."""
    points = domains.inside(one.region, 200)
    return (
        all(np.array_equal(a, b) for a, b in zip(one(points), other(points), strict=True))
        and np.array_equal(one.goal_image, other.goal_image)
        and np.array_equal(VelocityField(one)(points[0]), VelocityField(other)(points[0]))
        and one.region.equals_exact(other.region)
        and all(
            np.array_equal(getattr(one.accuracy, f.name), getattr(other.accuracy, f.name))
            for f in dataclasses.fields(one.accuracy)
        )
    )


@pytest.mark.parametrize(
    "question",
    [
        domains.u_corridor(),
        (box(0, 0, 3, 2).difference(box(1, 0.5, 1.5, 1)), Point(2.5, 1.5)),
        (box(0, 0, 3, 2), box(2, 0.5, 2.5, 1)),
        (box(0, 0, 3, 2), box(2.5, 0.5, 3, 1)),
    ],
    ids=["corridor", "hole", "goal region inside", "goal region on the outer ring"],
)
def test_a_map_that_was_kept_is_the_one_that_was_solved(store, question):
    solved = store.map_of(*question, tolerance=TOLERANCE)
    assert (store.found, len(store.files())) == (0, 1)
    read = MapStore(store.folder).map_of(*question, tolerance=TOLERANCE)
    assert same(read, solved)
    assert same(read, HarmonicMap(*question, tolerance=TOLERANCE))


def test_what_is_found_is_not_solved_again(store, monkeypatch):
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    monkeypatch.setattr("coop_drake.harmonic_maps.harmonic_map._solve", None)
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert store.found == 1


def test_another_question_is_another_map(store):
    domain, goal = domains.square()
    store.map_of(domain, goal, tolerance=TOLERANCE)
    store.map_of(domain, goal, tolerance=2 * TOLERANCE)
    store.map_of(domain, Point(0.3, np.nextafter(0.6, 1.0)), tolerance=TOLERANCE)
    store.map_of(box(0, 0, 1, np.nextafter(1.0, 2.0)), goal, tolerance=TOLERANCE)
    assert (store.found, len(store.files())) == (0, 4)


def test_other_code_is_another_map(store, monkeypatch):
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    monkeypatch.setattr("coop_drake.harmonic_maps.harmonic_map._code", lambda: b"later")
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert (store.found, len(store.files())) == (0, 2)


def flip(content):
    """Change one bit in the middle."""
    half = len(content) // 2
    return content[:half] + bytes([content[half] ^ 1]) + content[half + 1 :]


@pytest.mark.parametrize(
    "damage",
    [lambda content: content[:-100], lambda content: content[:200], lambda content: b"", flip],
    ids=["cut off", "almost nothing", "empty", "one bit"],
)
def test_a_damaged_file_is_replaced(store, damage):
    solved = store.map_of(*domains.square(), tolerance=TOLERANCE)
    (path,) = store.files()
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    assert same(store.map_of(*domains.square(), tolerance=TOLERANCE), solved)
    assert store.found == 0
    assert same(store.map_of(*domains.square(), tolerance=TOLERANCE), solved)
    assert store.found == 1


def test_a_file_under_the_name_of_another_question_is_not_believed(store):
    domain, goal = domains.square()
    store.map_of(domain, goal, tolerance=TOLERANCE)
    (first,) = store.files()
    store.map_of(domain, Point(0.5, 0.5), tolerance=TOLERANCE)
    (second,) = set(store.files()) - {first}
    second.write_bytes(first.read_bytes())
    assert store.map_of(domain, Point(0.5, 0.5), tolerance=TOLERANCE).goal.x == 0.5
    assert store.found == 0


def test_a_folder_that_cannot_be_written_keeps_nothing(tmp_path):
    (tmp_path / "maps").write_text("a file where the folder should be")
    store = MapStore(tmp_path / "maps")
    for _ in range(2):
        store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert (store.found, store.files(), store.size()) == (0, [], 0)


def test_writers_at_the_same_time_do_no_harm(store):
    with ThreadPoolExecutor(4) as pool:
        futures = [pool.submit(store.map_of, *domains.square(), tolerance=TOLERANCE) for _ in range(8)]
        maps = [future.result() for future in futures]
    assert all(same(other, maps[0]) for other in maps)
    assert [path.suffixes for path in store.folder.iterdir()] == [[".map", ".npz"]]


def test_a_map_that_fails_is_refused_every_time(store):
    for _ in range(2):
        with pytest.raises(FieldError):
            store.map_of(box(0, 0, 1, 1), Point(2, 2), tolerance=TOLERANCE)
    assert store.files() == []


def test_the_maps_not_used_for_longest_are_forgotten_first(store):
    sides = (1.0, 1.1, 1.2)
    for side in (*sides, sides[0]):  # the first one is used again
        store.map_of(box(0, 0, 1, side), Point(0.5, 0.5), tolerance=TOLERANCE)
    oldest, *others = store.files()
    MapStore(store.folder, limit=store.size() - 1).trim()
    assert store.files() == others
    store.map_of(box(0, 0, 1, sides[0]), Point(0.5, 0.5), tolerance=TOLERANCE)
    assert store.found == 2
    assert not oldest.exists()


def test_a_store_can_be_cleared(store):
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert store.size() > 0
    store.clear()
    assert store.files() == []
    store.clear()
    store.map_of(*domains.square(), tolerance=TOLERANCE)
    assert store.found == 0
