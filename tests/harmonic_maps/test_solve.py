"""Compressed systems have the solution of dense ones."""

import numpy as np
import pytest
from shapely import Point, box, union_all

from coop_drake.harmonic_maps import solve
from coop_drake.harmonic_maps.outline import outline_of
from coop_drake.harmonic_maps.panels import lay_panels
from coop_drake.harmonic_maps.solve import solve_density
from tests.support import domains

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
