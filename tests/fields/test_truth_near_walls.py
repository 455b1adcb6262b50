"""No point of a cell is sent out of the disk, nowhere is the map folded, and walls have values too."""

import numpy as np
import pytest
import shapely
from shapely import Point, box

from coop_drake.fields import HarmonicMap
from coop_drake.geometry import BoundaryDistance
from tests.support import domains

HALL = box(0, 0, 4, 2)
WAREHOUSE, GOAL = domains.warehouse()
SHELVES, SHELF_GOAL = domains.long_shelves(2)
DOMAINS = {
    "square": domains.square(),
    "U corridor": domains.u_corridor(),
    "warehouse": (WAREHOUSE, GOAL),
    "maze": domains.maze(6),
    "Minkowski, mitre": (WAREHOUSE.buffer(-0.15, join_style="mitre"), GOAL),
    "Minkowski, round": (WAREHOUSE.buffer(-0.15, quad_segs=3), GOAL),
    "goal on the outer ring": (WAREHOUSE, box(6.5, 4.8, 8, 6)),
    "goal in the interior": (WAREHOUSE, box(7, 5.2, 7.8, 5.8)),
    "long shelves": (SHELVES, SHELF_GOAL),
    "holes 1 cm apart": (
        HALL.difference(box(1, 0.5, 1.995, 1.5)).difference(box(2.005, 0.5, 3, 1.5)),
        Point(3.5, 1),
    ),
    "needle": domains.needle(10),
    "blade": domains.blade(350),
}


@pytest.fixture(scope="module", params=DOMAINS)
def mapped(request):
    domain, goal = DOMAINS[request.param]
    return HarmonicMap(domain, goal, tolerance=1e-6)


def grid(region, count):
    """Points of a square grid in a region, a little more than ``count``."""
    x0, y0, x1, y1 = region.bounds
    h = np.sqrt(region.area / (1.05 * count))
    x, y = np.meshgrid(np.arange(x0 + 0.5 * h, x1, h), np.arange(y0 + 0.5 * h, y1, h))
    points = np.column_stack((x.ravel(), y.ravel()))
    return points[shapely.contains_xy(region, *points.T)]


def test_disk_is_kept_and_nothing_is_folded(mapped):
    points = grid(mapped.region, 20_000)
    assert len(points) >= 20_000
    close, _ = domains.off_wall(mapped.region, 1e-3, 25)
    close = close[shapely.contains_xy(mapped.region, *close.T)]
    everywhere = np.concatenate((points, close))
    T, J = mapped(everywhere)
    assert (np.hypot(*T.T) < 1.0).all()
    # The error of T is harmonic and bounded: its gradient is at most 4 / pi times bound over distance.
    distance = BoundaryDistance(mapped.region).batch(everywhere)
    J_error = np.sqrt(2.0) * 4.0 / np.pi * mapped.accuracy.error_estimate / distance
    det_error = 2.0 * np.linalg.norm(J, 2, axis=(1, 2)) * J_error + J_error**2
    det = np.linalg.det(J)
    assert (det > -det_error).all()
    certain = np.abs(det) > det_error
    assert (det[certain] > 0.0).all()
    assert np.mean(certain) > 0.6


def test_walls_and_vertices_have_values(mapped):
    rings = [mapped.region.exterior, *mapped.region.interiors]
    vertices = np.concatenate([shapely.get_coordinates(ring) for ring in rings])
    walls, _ = domains.off_wall(mapped.region, 0.0, 11)
    hair = 1e-13 * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    for points in (vertices, walls, (vertices[:, None] + hair).reshape(-1, 2)):
        T, J = mapped(points)
        assert np.isfinite(T).all()
        assert np.isfinite(J).all()
        assert (np.hypot(*T.T) <= 1.0 + 1.5 * mapped.accuracy.error_estimate).all()
