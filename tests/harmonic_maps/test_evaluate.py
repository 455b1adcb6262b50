"""A map as one array: nothing is lost, compiled code sees what Python sees, series equal sums over all."""

import numba
import numpy as np
import pytest
from shapely import Point, affinity, box

from coop_drake.harmonic_maps import HarmonicMap, VelocityField
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
from tests.support import domains


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
    back = unflatten(flatten(numbered, np.array([3.0, -4.0]), 0.5))
    for name in MapArrays._fields:
        np.testing.assert_array_equal(getattr(back, name), getattr(numbered, name))
        assert getattr(back, name).dtype == getattr(numbered, name).dtype
        assert getattr(back, name).size > 0


def test_floats_come_back_bit_by_bit(moved_map):
    arrays = moved_map.solution.arrays
    odd = arrays._replace(breaks=np.array([np.nan, np.inf, -0.0, 5e-324]))
    back = unflatten(flatten(odd, np.array([3.0, -4.0]), 0.5))
    assert back.breaks.tobytes() == odd.breaks.tobytes()


def test_centre_and_rounding_come_back(moved_map):
    flat = flatten(moved_map.solution.arrays, np.array([3.0, -4.0]), 0.5)
    assert flat[:3].tolist() == [3.0, -4.0, 0.5]


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
        # Sums may be added in any order: compiled into another function they may round differently.
        np.testing.assert_allclose(seen, tuple(field(point)), rtol=0.0, atol=1e-14)


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
@pytest.mark.slow
def test_sharp_corners_of_many_nodes_fit():
    domain, goal = domains.needle(1.05)
    harmonic_map = HarmonicMap(domain, goal)
    assert harmonic_map.solution.arrays.corner_index[:-1, 2].max() > 512
    T, J = harmonic_map(domains.inside(domain, 100))
    assert (np.hypot(*T.T) < 1.0).all()
    assert (np.linalg.det(J) > 0.0).all()
