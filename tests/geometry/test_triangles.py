"""A triangulation of a polygon between points of its rings."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from shapely import box

from coop_drake.geometry.passage import triangulate
from tests.support.shapes import floors_with_ends

HALL = box(0, 0, 6, 4)
TWO_CRATES = HALL.difference(box(1, 1, 2, 3)).difference(box(2.2, 1, 3, 3))


@given(floors_with_ends())
@settings(max_examples=20)
def test_triangles_fill_the_polygon_and_their_diagonals_join_them(floor_with_ends):
    floor, _ = floor_with_ends
    mesh = triangulate(floor)
    triangles = shapely.polygons(mesh.vertices[mesh.corners])
    assert shapely.area(triangles).sum() == pytest.approx(floor.area)
    # Euler: every hole adds one diagonal to those of a tree of triangles, unless it touches another ring.
    apart = shapely.get_num_geometries(floor.boundary.buffer(1e-6))
    assert len(mesh.diagonals) == len(mesh.corners) - 1 + (apart - 1)
    for ends, sides in zip(mesh.diagonals, mesh.neighbours, strict=True):
        assert all(set(ends) <= set(mesh.corners[t]) for t in sides)
    for ring, shape in enumerate((floor.exterior, *floor.interiors)):
        on_ring = shapely.points(mesh.vertices[mesh.ring == ring])
        assert shapely.distance(shape, on_ring).max() < 1e-9


def test_pieces_are_short_where_the_opposite_wall_is_near():
    mesh = triangulate(TWO_CRATES)
    facing = mesh.vertices[(mesh.ring == 1) & (mesh.vertices[:, 0] == 2.0)]
    assert np.diff(np.sort(facing[:, 1])).max() <= 0.2
    across = shapely.LineString([(2, 2), (2.2, 2)])
    lines = shapely.linestrings(mesh.vertices[mesh.diagonals])
    crossing = lines[(mesh.ring[mesh.diagonals] == [1, 2]).all(axis=1)]
    assert shapely.length(crossing).min() == pytest.approx(across.length)


def test_repeated_points_do_no_harm():
    doubled = shapely.Polygon([(0, 0), (2, 0), (2, 0), (2, 1), (0, 1), (0, 1)])
    mesh = triangulate(doubled)
    assert shapely.area(shapely.polygons(mesh.vertices[mesh.corners])).sum() == pytest.approx(2.0)
