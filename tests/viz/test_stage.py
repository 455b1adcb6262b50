"""Obstacles on the floor: long ones are shelves, short ones pillars, and those not convex are walls."""

from __future__ import annotations

import pytest
from pydrake.geometry import Meshcat
from shapely import Polygon, box

from coop_drake.viz.scene import set_stage

FLOOR = box(0, 0, 6, 5)
SHELF, PILLAR = Polygon([(1, 1), (3, 1.5), (2.9, 1.9), (0.9, 1.4)]), box(4, 3, 4.4, 3.3)


@pytest.fixture
def standing():
    meshcat = Meshcat()
    set_stage(meshcat, FLOOR - SHELF - PILLAR, 0.5)
    return meshcat


def test_a_long_obstacle_is_a_shelf_and_a_short_one_a_pillar(standing):
    kinds = sorted(
        f"{kind}/{index}"
        for kind in ("shelves", "pillars")
        for index in ("00", "01")
        if standing.HasPath(f"/stage/{kind}/{index}")
    )
    assert len(kinds) == 2
    assert {kind.split("/")[0] for kind in kinds} == {"shelves", "pillars"}


def test_an_obstacle_that_is_not_convex_is_a_wall():
    corner = Polygon([(1, 1), (3, 1), (3, 1.2), (1.2, 1.2), (1.2, 3), (1, 3)])
    meshcat = Meshcat()
    set_stage(meshcat, FLOOR - corner - PILLAR, 0.5)
    assert not meshcat.HasPath("/stage/shelves/00")
    assert meshcat.HasPath("/stage/pillars/00")
    assert not meshcat.HasPath("/stage/pillars/01")


def test_floor_grid_and_walls_stand_on_every_stage(standing):
    for name in ("floor", "grid", "walls", "edges/foot", "edges/top"):
        assert standing.HasPath(f"/stage/{name}")


def test_a_floor_smaller_than_a_metre_needs_no_grid():
    meshcat = Meshcat()
    set_stage(meshcat, box(0.2, 0.2, 0.9, 0.8), 0.5)
    assert meshcat.HasPath("/stage/floor")
