"""Meshes keep the area of what they stand for."""

import numpy as np
import pytest
from shapely import Point, Polygon, box

from coop_drake.drawing.solids import (
    flat_mesh,
    joined,
    ribbon_mesh,
    ring_lines,
    slab_mesh,
    tube_mesh,
    wall_polygons,
)

FLOOR = Polygon([(0, 0), (4, 0), (4, 3), (2, 1), (0, 3)], [[(1, 0.5), (2, 0.5), (2, 0.8)]])


def area(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def test_a_flat_mesh_has_the_polygons_area_and_height():
    mesh = flat_mesh([FLOOR], 0.3)
    assert area(mesh) == pytest.approx(FLOOR.area)
    assert set(mesh.vertices[:, 2]) == {0.3}


def test_a_wall_has_its_top_and_all_its_sides():
    assert area(slab_mesh([FLOOR], 0.0, 0.5)) == pytest.approx(FLOOR.area + 0.5 * FLOOR.length)


def test_walls_stand_beside_the_floor_never_on_it():
    walls = wall_polygons(FLOOR, 0.1)
    assert sum(wall.intersection(FLOOR).area for wall in walls) == pytest.approx(0.0, abs=1e-12)
    assert sum(wall.area for wall in walls) > FLOOR.exterior.length * 0.1


def test_a_thin_wall_between_two_rooms_is_drawn_whole():
    rooms = box(0, 0, 3, 2) | box(3.2, 0, 6, 2) | box(2, 0.8, 4, 1.2)
    within = [wall for wall in wall_polygons(rooms, 0.08) if wall.contains(Point(3.1, 1.5))]
    assert len(within) == 1


def test_ring_lines_run_once_round_every_ring():
    start, end = ring_lines([FLOOR, box(0, 0, 1, 1)], 0.2)
    assert start.shape == end.shape == (3, 5 + 3 + 4)
    assert np.linalg.norm(end - start, axis=0).sum() == pytest.approx(FLOOR.length + 4.0)


def test_a_slab_stands_between_its_heights():
    mesh = slab_mesh([FLOOR], 0.2, 0.3)
    assert area(mesh) == pytest.approx(FLOOR.area + 0.1 * FLOOR.length)
    assert (mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()) == (0.2, 0.3)


def test_a_ribbon_has_two_triangles_a_piece_in_the_order_of_the_line():
    points = np.column_stack([np.linspace(0.0, 3.0, 7), np.zeros(7)])
    mesh = ribbon_mesh(points, 0.1, 0.02)
    assert mesh.faces.shape == (12, 3)
    assert area(mesh) == pytest.approx(0.3)
    middles = mesh.vertices[mesh.faces, 0].mean(axis=1).reshape(-1, 2).mean(axis=1)
    np.testing.assert_allclose(middles, points[:-1, 0] + 0.25)


def test_joined_meshes_keep_their_areas():
    mesh = joined([flat_mesh([FLOOR], 0.0), slab_mesh([FLOOR], 0.2, 0.3)])
    assert area(mesh) == pytest.approx(2.0 * FLOOR.area + 0.1 * FLOOR.length)


def test_a_tube_has_the_surface_of_a_prism_and_stops_where_the_line_is_interrupted():
    points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [np.nan] * 3, [5.0, 1.0, 0.0], [5.0, 1.0, 3.0]])
    mesh = tube_mesh(points, 0.01)
    # Six sides as broad as the radius; each of the two pieces is longer by the radius.
    assert area(mesh) == pytest.approx(6 * 0.01 * (5.0 + 2 * 0.01))
