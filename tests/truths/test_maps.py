"""What is true of all cells: nothing leaves a map's; under-cells are free, all that is free in over-cells."""

from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.polynomial.legendre import leggauss
from shapely import MultiPolygon, Point, Polygon, affinity, box
from shapely.affinity import scale

from coop_drake.geometry.minkowski import to_polygon
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.harmonic_maps import HarmonicMap, VelocityField, trace_streamlines
from coop_drake.planning.cells.cells import CellMaker, Region
from tests.support import domains
from tests.support.free_positions import FreePositions, nudges
from tests.support.shapes import floors
from tests.support.trees import body_footprints, configurations, room, slices_of, trees

FEW = settings(
    max_examples=12,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)


@st.composite
def stars(draw):
    """A star-shaped polygon with 4 to 14 vertices."""
    radii = draw(st.lists(st.floats(0.25, 1.5), min_size=4, max_size=14))
    shifts = draw(st.lists(st.floats(-0.35, 0.35), min_size=len(radii), max_size=len(radii)))
    angle = 2 * np.pi * (np.arange(len(radii)) + np.array(shifts)) / len(radii)
    return Polygon(np.column_stack((radii * np.cos(angle), radii * np.sin(angle))))


@st.composite
def corridors(draw):
    """Boxes along a walk on a lattice: corridors, rooms and doors, holes filled."""
    width = draw(st.sampled_from([0.2, 0.35, 0.6, 0.9]))
    x = y = 0
    boxes = [box(-0.5, -0.4, 0.45, 0.5)]
    for dx, dy in draw(st.lists(st.sampled_from([(1, 0), (0, 1), (-1, 0), (0, -1)]), min_size=2, max_size=7)):
        line = shapely.LineString([(x, y), (x + dx, y + dy)])
        boxes.append(line.buffer(width / 2, cap_style="square"))
        x, y = x + dx, y + dy
    return Polygon(shapely.union_all(boxes).exterior)


CELLS = st.one_of(stars(), corridors())


def goal_of(cell):
    return Point(shapely.maximum_inscribed_circle(cell).coords[0])


def unit(velocity):
    return velocity / np.hypot(*velocity)


@pytest.mark.slow
def test_no_streamline_leaves_its_cell_and_all_but_a_null_set_arrive(record_property):
    rng = np.random.default_rng(4)
    count, lost, slow = 0, {True: 0, False: 0}, 0
    for k in range(30):
        cell = domains.random_room(rng, holes=k % 3 if k < 15 else 0)
        goal = goal_of(cell)
        starts = domains.inside(cell, 2000, seed=k)[:340]
        streamlines = trace_streamlines(VelocityField(HarmonicMap(cell, goal, tolerance=1e-6)), starts)
        assert shapely.contains_xy(cell, *np.concatenate(streamlines.paths).T).all()
        count += len(starts)
        lost[bool(cell.interiors)] += int(np.sum(~streamlines.arrived))
        slow += int(np.sum(streamlines.times > 3.0 * np.median(streamlines.times)))
    record_property("starts", count)
    record_property("starts that did not arrive", lost)
    record_property("starts that took three times the median", slow)
    assert count >= 10_000
    assert lost[False] == 0
    assert lost[True] <= 5  # collapsed holes stop single streamlines
    assert slow <= 5


@FEW
@given(CELLS)
def test_field_is_lipschitz_along_streamlines(cell):
    field = VelocityField(HarmonicMap(cell, goal_of(cell)))
    starts = domains.inside(cell, 60, clearance=0.02)[:20]
    for path in trace_streamlines(field, starts).paths:
        steepest = [steepness(field, path, parts) for parts in (4, 40)]
        assert steepest[1] <= 2.0 * steepest[0] + 0.1  # a jump would make it ten times steeper


def steepness(field, path, parts):
    """Largest change of the field per distance along a polyline, each chord cut into parts [1/s]."""
    part = np.arange(parts)[:, None] / parts
    points = np.concatenate([a + part * (b - a) for a, b in pairwise(path)])
    return np.max(
        np.linalg.norm(np.diff(field(points), axis=0), axis=1)
        / np.linalg.norm(np.diff(points, axis=0), axis=1)
    )


@FEW
@given(CELLS)
def test_disk_is_filled_without_folds_to_the_certified_error_and_walls_push_inwards(cell):
    harmonic_map = HarmonicMap(cell, goal_of(cell))
    field = VelocityField(harmonic_map)
    near, _ = domains.off_wall(cell, 1e-3)
    near = near[shapely.contains_xy(cell, *near.T)]
    T, J = harmonic_map(np.concatenate((domains.inside(cell, 2000), near)))
    assert (np.hypot(*T.T) < 1.0).all()
    det = np.linalg.det(J)
    noise = 1e-6 * np.linalg.norm(J, axis=(1, 2)) ** 2
    assert (det > -noise).all()
    walls, normals = domains.off_wall(cell, 0.0)
    assert min(field(p) @ n for p, n in zip(walls, normals, strict=True)) > 0.0
    edge = shapely.get_coordinates(shapely.segmentize(harmonic_map.region.exterior, 0.003))
    error = np.abs(np.hypot(*harmonic_map(edge)[0].T) - 1.0).max()
    assert error <= 1.5 * harmonic_map.accuracy.error_estimate + 1e-12


@FEW
@given(CELLS, st.floats(-3.0, 3.0), st.floats(0.05, 20.0), st.floats(-50.0, 50.0))
def test_direction_turns_with_the_cell_and_ignores_its_place_and_size(cell, angle, scale, shift):
    def moved(shape):
        turned = affinity.rotate(shape, angle, origin=(0, 0), use_radians=True)
        return affinity.translate(affinity.scale(turned, scale, scale, origin=(0, 0)), shift, -shift)

    goal = goal_of(cell)
    here = VelocityField(HarmonicMap(cell, goal))
    there = VelocityField(HarmonicMap(moved(cell), moved(goal)))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for point in domains.inside(cell, 30, clearance=0.01):
        image = np.asarray(moved(Point(point)).coords[0])
        np.testing.assert_allclose(unit(there(image)), turn @ unit(here(point)), atol=1e-4)


@pytest.fixture(scope="module", params=[1, 2, 3])
def mapped(request):
    room = domains.random_room(np.random.default_rng(request.param), holes=4)
    return HarmonicMap(room, Point(shapely.maximum_inscribed_circle(room).coords[0]))


def circles(region, count):
    """Circles in a region, some of them round holes of it; shape (1501, 2) each, closed."""
    rng, filled = np.random.default_rng(0), Polygon(region.exterior)
    turn = np.linspace(0.0, 2.0 * np.pi, 1501)[:, None]
    found = []
    while len(found) < count:
        circle = rng.uniform(-1.0, 1.0, 2) + rng.uniform(0.1, 0.8) * np.hstack((np.cos(turn), np.sin(turn)))
        line = shapely.linestrings(circle)
        if filled.contains(line) and region.boundary.distance(line) > 0.01:
            found.append(circle)
    return found


def windings(curve, points):
    """How often a closed curve winds round every point, and the largest angle of its steps [rad]."""
    to_curve = (curve @ [1.0, 1.0j]) - (points @ [1.0, 1.0j])[:, None]
    steps = np.angle(to_curve[:, 1:] / to_curve[:, :-1])
    return np.rint(steps.sum(axis=1) / (2.0 * np.pi)), np.abs(steps).max()


def test_the_image_of_a_circle_winds_once_round_what_comes_from_inside(mapped):
    points = domains.inside(mapped.region, 300)
    for circle in circles(mapped.region, 8):
        clear = shapely.distance(shapely.linestrings(circle), shapely.points(points)) > 0.02
        inside = shapely.contains_xy(Polygon(circle), *points[clear].T)
        count, step = windings(mapped(circle)[0], mapped(points[clear])[0])
        assert 0 < inside.sum() < len(inside)
        assert step < 0.5 * np.pi
        np.testing.assert_array_equal(count, inside)


def test_nothing_flows_into_a_hole(mapped):
    """Where a hole goes is fixed by this: integrated round it, the derivative of T across the way is zero."""
    walls, holes = mapped.region.boundary, [Polygon(ring) for ring in mapped.region.interiors]
    assert holes
    for hole in holes:
        room = hole.distance(walls.difference(hole.boundary))
        way = shapely.segmentize(hole.buffer(0.4 * room).exterior, 0.2 * room)
        flux, across = flux_through(mapped, shapely.get_coordinates(way))
        # The error of T is harmonic and at most the estimated one: so steep it can be at this distance.
        error = 4.0 * mapped.accuracy.error_estimate / (np.pi * walls.distance(way)) * way.length
        assert np.hypot(*flux) < error
        assert error < 1e-4 * across


def flux_through(harmonic_map, ring):
    """Integral of J n along a closed ring, shape (2,), and that of its magnitude."""
    node, weight = leggauss(12)
    step = np.diff(ring, axis=0)
    points = ring[:-1, None] + 0.5 * (1.0 + node)[:, None] * step[:, None]
    normal = np.column_stack((step[:, 1], -step[:, 0]))  # as long as its piece
    flow = np.einsum("psij,pj->psi", harmonic_map(points)[1], normal) * 0.5 * weight[:, None]
    return flow.sum(axis=(0, 1)), np.linalg.norm(flow, axis=-1).sum()


# Under-cells lie inside free space, free space inside over-cells, at a million configurations.


SLOW = settings(max_examples=40)
MANY_SLICES = settings(SLOW, max_examples=170)
ANGLES, POSITIONS = 4, 1_500  # 170 slices x 4 angles x 1,500 positions: a million configurations


@SLOW
@given(st.data())
def test_every_piece_stays_between_its_sweeps(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    swept = SweptTree(tree)
    poses = [tree.poses(z) for z in configurations(intervals, seed=1, count=60)]
    for index, piece in enumerate(swept.pieces):
        copies = np.array([X_WC[piece.component].apply(piece.shape.vertices) for X_WC in poses])
        over = swept.over(index, intervals)
        outline, corners = Polygon(over), shapely.points(copies.reshape(-1, 2))
        assert shapely.covers(outline, corners).all()
        assert shapely.distance(outline.exterior, corners).min() >= piece.shape.radius - 1e-11
        under = swept.under(index, intervals)
        if under is not None:
            cores = shapely.convex_hull(shapely.multipoints(copies))
            far = shapely.distance(cores[:, None], shapely.points(under)[None, :])
            assert far.max() <= piece.shape.radius + 1e-11


@pytest.mark.slow
@MANY_SLICES
@given(st.data())
def test_under_cells_are_free_and_free_space_is_in_over_cells(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    size = data.draw(st.sampled_from((1.0, 3.0, 6.0)))
    workspace = scale(data.draw(floors()), size, size, origin=(0.0, 0.0))
    random = np.random.default_rng(data.draw(st.integers(0, 1000)))
    swept = SweptTree(tree)
    maker = CellMaker(swept, workspace)
    under, over = union(maker.under_cells(intervals)), union(maker.over_cells(intervals))
    for z in configurations(intervals, seed=int(random.integers(1 << 30)), count=ANGLES):
        exact = FreePositions(tree, workspace, z[2:])
        positions = np.concatenate(
            (
                exact.contacts(random, POSITIONS // 4),
                near_boundary(under, random, POSITIONS // 4),
                near_boundary(over, random, POSITIONS // 4),
                random.uniform(workspace.bounds[:2], workspace.bounds[2:], (POSITIONS // 4, 2)),
            )
        )
        free = exact.free(positions)
        assert free[shapely.contains_xy(under, positions)].all()
        assert shapely.contains_xy(over, positions[free]).all()


def union(regions: list[Region]) -> MultiPolygon:
    whole = MultiPolygon([to_polygon(region.section) for region in regions])
    shapely.prepare(whole)
    return whole


def near_boundary(shape: MultiPolygon, random: np.random.Generator, count: int) -> np.ndarray:
    """Points at corners and along edges of a shape, a hair aside; around the origin if it is empty."""
    corners = shapely.get_coordinates(shape) if not shape.is_empty else np.zeros((1, 2))
    first = random.integers(len(corners), size=count)
    last = np.minimum(first + 1, len(corners) - 1)
    share = random.random((count, 1)) * (random.random((count, 1)) < 0.5)
    return corners[first] + share * (corners[last] - corners[first]) + nudges(random, count)


@SLOW
@given(st.data())
def test_pairs_judge_like_exact_footprints(data: st.DataObject) -> None:
    tree = data.draw(trees(robots=(2, 3)))
    intervals = data.draw(slices_of(tree))
    pairs = SweptTree(tree).pairs
    touching, overlapping = pairs.touching(intervals), pairs.overlapping(intervals)
    for z in configurations(intervals, seed=3, count=10):
        bodies = body_footprints(tree, z)
        contact = [a for a, b in tree.collision_pairs if bodies[a].intersects(bodies[b])]
        if touching is None:
            assert not contact
        if overlapping is not None:
            assert contact


@SLOW
@given(st.data())
def test_halving_never_loosens(data: st.DataObject) -> None:
    tree = data.draw(trees())
    intervals = data.draw(slices_of(tree))
    swept = SweptTree(tree)
    maker = CellMaker(swept, room())
    axis = data.draw(st.integers(0, len(intervals) - 1))
    lower, upper = intervals[axis]
    half = (*intervals[:axis], (lower, 0.5 * (lower + upper)), *intervals[axis + 1 :])
    whole_over, half_over = maker.over_cells(intervals), maker.over_cells(half)
    assert sum(r.area for r in half_over) <= sum(r.area for r in whole_over) + 5e-3
    for region in maker.under_cells(intervals):
        point = Point(*region.rings[0].mean(axis=0))
        if (
            region.holds(np.array([point.x, point.y]))
            and region.depths(np.array([[point.x, point.y]]))[0] > 0.02
        ):
            assert any(r.holds(np.array([point.x, point.y])) for r in maker.under_cells(half))
