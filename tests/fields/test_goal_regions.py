import numpy as np
import pytest
import shapely
from shapely import Point, box

from coop_drake.fields import HarmonicMap, VelocityField, trace_streamlines
from tests.support import domains

ROOM = box(0, 0, 4, 2)


def all_arrive(harmonic_map, count, *, clearance=0.02):
    starts = domains.inside(harmonic_map.region, count, clearance=clearance)
    streamlines = trace_streamlines(VelocityField(harmonic_map), starts)
    region = harmonic_map.region
    inside = all(shapely.covers(region, shapely.points(path)).all() for path in streamlines.paths)
    return len(starts) > 0 and inside and streamlines.arrived.all()


def test_interior_goal_collapses_like_a_hole():
    goal = box(2.5, 0.5, 3.3, 1.2)
    harmonic_map = HarmonicMap(ROOM, goal)
    assert np.hypot(*harmonic_map.goal_image) < 1.0
    ring = shapely.points([goal.exterior.interpolate(s).coords[0] for s in np.linspace(0, 3, 30)])
    T, _ = harmonic_map(shapely.get_coordinates(ring))
    np.testing.assert_allclose(T, np.broadcast_to(harmonic_map.goal_image, T.shape), atol=1e-7)
    assert all_arrive(harmonic_map, 100)


@pytest.mark.parametrize("goal", [box(3.2, 0, 4, 2), box(3, 1.5, 4, 2), box(1, 0, 2, 0.4)])
def test_goal_on_the_outer_ring_collapses_to_a_point_of_the_circle(goal):
    harmonic_map = HarmonicMap(ROOM, goal)
    assert np.hypot(*harmonic_map.goal_image) == pytest.approx(1.0)
    arc = shapely.intersection(goal.boundary, harmonic_map.region.exterior)
    inner = [
        p for p in shapely.get_coordinates(shapely.segmentize(arc, 0.05)) if 0 < p[0] < 4 and 0 < p[1] < 2
    ]
    T, _ = harmonic_map(np.array(inner))
    np.testing.assert_allclose(T, np.broadcast_to(harmonic_map.goal_image, T.shape), atol=1e-6)
    assert all_arrive(harmonic_map, 100)


def test_goal_that_splits_the_domain_is_reached_from_the_chosen_side():
    goal = box(1.5, 0, 2, 2)
    for inside, side in ((Point(0.5, 1), box(0, 0, 1.5, 2)), (Point(3, 1), box(2, 0, 4, 2))):
        harmonic_map = HarmonicMap(ROOM, goal, inside=inside)
        assert harmonic_map.region.equals(side)
        assert all_arrive(harmonic_map, 50)


def test_goal_and_obstacles_collapse_together():
    domain, _ = domains.warehouse()
    goal = box(7, 5.2, 7.8, 5.8)
    harmonic_map = HarmonicMap(domain, goal)
    assert harmonic_map.accuracy.error_estimate == 15 * harmonic_map.accuracy.residual
    T, J = harmonic_map(domains.inside(harmonic_map.region, 2000, clearance=1e-3))
    assert (np.hypot(*T.T) < 1.0).all()
    assert (np.linalg.det(J) > 0.0).all()
