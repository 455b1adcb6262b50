"""Power series in the quadtree against sums over everything."""

import numpy as np
import pytest
from shapely import Point, box

from coop_drake.fields import HarmonicMap
from coop_drake.fields.evaluation import evaluate_many
from coop_drake.fields.flat_map import INSIDE, ON_BOUNDARY, OUTSIDE, flatten, rounding_of
from tests.support import domains

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
    alone = flatten(without_boxes(mapped.solution.arrays), centre, rounding_of(flat))
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


def test_sharp_corners_of_many_nodes_fit():
    domain, goal = domains.needle(1.05)
    harmonic_map = HarmonicMap(domain, goal)
    assert harmonic_map.solution.arrays.corner_index[:-1, 2].max() > 512
    T, J = harmonic_map(domains.inside(domain, 100))
    assert (np.hypot(*T.T) < 1.0).all()
    assert (np.linalg.det(J) > 0.0).all()
