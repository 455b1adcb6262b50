import numpy as np
import pytest
import shapely
from shapely import Point, box

from coop_drake.fields import HarmonicMap, VelocityField
from tests.support import domains

ROOM = box(0, 0, 4, 2)


def arrives(field, start, goal, *, steps=4000):
    point = np.array(start, dtype=float)
    for _ in range(steps):
        if goal.distance(Point(point)) < 1e-3:
            return True
        velocity = field(point)
        step = 0.02 * velocity / np.hypot(*velocity) * min(1.0, 5.0 * goal.distance(Point(point)))
        point = point + 0.5 * step + 0.5 * np.hypot(*step) * _direction(field, point + step)
    return False


def _direction(field, point):
    velocity = field(point)
    return velocity / max(np.hypot(*velocity), 1e-300)


def test_interior_goal_collapses_like_a_hole():
    goal = box(2.5, 0.5, 3.3, 1.2)
    harmonic_map = HarmonicMap(ROOM, goal)
    assert np.hypot(*harmonic_map.goal_image) < 1.0
    ring = shapely.points([goal.exterior.interpolate(s).coords[0] for s in np.linspace(0, 3, 30)])
    T, _ = harmonic_map(shapely.get_coordinates(ring))
    np.testing.assert_allclose(T, np.broadcast_to(harmonic_map.goal_image, T.shape), atol=1e-7)
    field = VelocityField(harmonic_map)
    starts = domains.inside(harmonic_map.region, 40, clearance=0.02)
    missed = [start for start in starts if not arrives(field, start, goal)]
    assert not missed


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
    field = VelocityField(harmonic_map)
    for start in domains.inside(harmonic_map.region, 25, clearance=0.02):
        assert arrives(field, start, goal)


def test_goal_that_splits_the_domain_is_reached_from_the_chosen_side():
    goal = box(1.5, 0, 2, 2)
    for inside, side in ((Point(0.5, 1), box(0, 0, 1.5, 2)), (Point(3, 1), box(2, 0, 4, 2))):
        harmonic_map = HarmonicMap(ROOM, goal, inside=inside)
        assert harmonic_map.region.equals(side)
        field = VelocityField(harmonic_map)
        for start in domains.inside(side, 10, clearance=0.02):
            assert arrives(field, start, goal)


def test_goal_and_obstacles_collapse_together():
    domain, _ = domains.warehouse()
    goal = box(7, 5.2, 7.8, 5.8)
    harmonic_map = HarmonicMap(domain, goal)
    assert harmonic_map.certificate.error_bound == 15 * harmonic_map.certificate.residual
    T, J = harmonic_map(domains.inside(harmonic_map.region, 2000, clearance=1e-3))
    assert (np.hypot(*T.T) < 1.0).all()
    assert (np.linalg.det(J) > 0.0).all()
