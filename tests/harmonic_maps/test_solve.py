"""Compressed corners, systems and maps give what fine corners, dense systems and sums of all panels give."""

import numba
import numpy as np
import pytest
from shapely import Point, affinity, box, union_all

from coop_drake.harmonic_maps import HarmonicMap, VelocityField, solve
from coop_drake.harmonic_maps.evaluate import (
    INSIDE,
    ON_BOUNDARY,
    OUTSIDE,
    MapArrays,
    evaluate_many,
    flatten,
    unflatten,
)
from coop_drake.harmonic_maps.field import velocity_in_field
from coop_drake.harmonic_maps.outline import outline_of
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


@pytest.mark.parametrize("degrees", [12.0, 90.0, 270.0])
def test_ring_and_the_scale_below_make_up_the_whole_corner(degrees):
    angle = np.deg2rad(degrees)
    operator = corner_operator(angle, 16, 1.5)
    grid, ring = leg_panels(angle, 1.5)
    _, w = panel_nodes(grid, 16)
    _, w_ring = panel_nodes(ring, 16)
    for parity in (0, 1):
        whole = w @ operator.compressed[parity]
        below = 0.5 * w @ operator.compressed[parity] @ operator.inward[parity]
        np.testing.assert_allclose(w_ring @ operator.ring[parity] + below, whole, atol=1e-11)


def test_straight_corner_changes_nothing():
    operator = corner_operator(np.pi, 10, 1.5)
    np.testing.assert_allclose(operator.compressed, np.broadcast_to(np.eye(10), (2, 10, 10)), atol=1e-12)


def test_sharp_corners_have_finer_rings():
    assert len(leg_panels(np.pi / 2, 1.5)[1]) == 2
    assert len(leg_panels(np.deg2rad(5), 1.5)[1]) > len(leg_panels(np.deg2rad(20), 1.5)[1]) > 2
    np.testing.assert_allclose(leg_panels(np.deg2rad(350), 1.5)[1], leg_panels(np.deg2rad(10), 1.5)[1])


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


def test_arrays_come_back_by_their_names(moved_map):
    arrays = moved_map.solution.arrays
    numbered = MapArrays(*(np.full_like(array, k) for k, array in enumerate(arrays)))
    numbered = numbered._replace(breaks=np.array([np.nan, np.inf, -0.0, 5e-324]))
    flat = flatten(numbered, np.array([3.0, -4.0]), 0.5)
    assert flat[:3].tolist() == [3.0, -4.0, 0.5]
    for back, array in zip(unflatten(flat), numbered, strict=True):
        assert (back.dtype, back.tobytes()) == (array.dtype, array.tobytes())
        assert back.size > 0


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


def test_little_is_near_any_point(mapped):
    arrays = mapped.solution.arrays
    count = np.diff(arrays.near_start)
    assert count.max() <= 24
    assert count[arrays.leaf_state == OUTSIDE].sum() == 0
    assert count[arrays.leaf_state == INSIDE].mean() < 8


def test_leaves_share_out_the_square(mapped):
    arrays = mapped.solution.arrays
    area = 2.0 * arrays.leaf_square[:, 2] ** 2
    assert area.sum() == pytest.approx((2.0 * arrays.root[2]) ** 2)
    assert sorted(-1 - arrays.boxes[arrays.boxes < 0]) == list(range(len(area)))


@pytest.mark.slow
def test_sharp_corners_of_many_nodes_fit():
    domain, goal = domains.needle(1.05)
    harmonic_map = HarmonicMap(domain, goal)
    assert harmonic_map.solution.arrays.corner_index[:-1, 2].max() > 512
    T, J = harmonic_map(domains.inside(domain, 100))
    assert (np.hypot(*T.T) < 1.0).all()
    assert (np.linalg.det(J) > 0.0).all()
