"""Maps against a solver of another kind that shares no code with them, on domains of every kind."""

import numpy as np
import pytest
from shapely import Polygon, box

from coop_drake.fields import HarmonicMap
from tests.support import domains
from tests.support.single_layer import SingleLayer

WAREHOUSE, GOAL = domains.warehouse()
DOMAINS = {
    "square": (*domains.square(), 40),
    "U corridor": (*domains.u_corridor(), 40),
    "warehouse": (WAREHOUSE, GOAL, 40),
    "maze": (*domains.maze(5), 80),
    "Minkowski, mitre": (WAREHOUSE.buffer(-0.15, join_style="mitre"), GOAL, 40),
    "Minkowski, round": (WAREHOUSE.buffer(-0.15, quad_segs=3), GOAL, 20),
    "goal on the outer ring": (WAREHOUSE, box(6.5, 4.8, 8, 6), 40),
}
ACCURACY = 4e-4  # of the oracle, whose elements are constant


@pytest.mark.parametrize("name", DOMAINS)
def test_map_and_jacobian_agree_with_a_single_layer(name):
    domain, goal, elements = DOMAINS[name]
    harmonic_map = HarmonicMap(domain, goal, tolerance=1e-6)
    region = harmonic_map.region
    collapsed = goal if isinstance(goal, Polygon) else None
    oracle = SingleLayer(region, elements=elements, collapsed=collapsed)
    points = domains.inside(region, 600, clearance=0.02)
    T, _ = harmonic_map(points)
    assert np.hypot(*(T - oracle(points)).T).max() < ACCURACY
    # A harmonic error of that size changes by its size within the distance to the wall.
    deep = domains.inside(region, 600, clearance=0.1)
    slack = 4.0 / np.pi * np.sqrt(2.0) * ACCURACY / 0.1
    assert np.linalg.norm(harmonic_map(deep)[1] - oracle.jacobian(deep), axis=(1, 2)).max() < slack


def test_the_oracle_converges_to_the_map():
    domain, goal = domains.u_corridor()
    points = domains.inside(domain, 300, clearance=0.1)
    T, _ = HarmonicMap(domain, goal, tolerance=1e-8)(points)
    errors = [np.abs(SingleLayer(domain, elements=n)(points) - T).max() for n in (10, 30, 90)]
    assert errors[1] < errors[0] / 3.0
    assert errors[2] < errors[1] / 3.0
