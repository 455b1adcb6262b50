"""Figures repeat byte for byte, walls look like walls, meshes keep areas, the camera sees the floor."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from shapely import Point, Polygon, box

from coop_drake.drawing import solids
from coop_drake.drawing.canvas import draw_workspace, new_figure, save_figure


@pytest.mark.parametrize(("suffix", "begins"), [(".png", b"\x89PNG"), (".svg", b"<?xml")])
def test_the_same_figure_gives_the_same_bytes_of_the_kind_that_the_name_asks_for(tmp_path, suffix, begins):
    written = []
    for name in ("a", "b"):
        figure = new_figure(3.0, 2.0, "A caption.")
        figure.subplots().plot([0.0, 1.0], [0.0, 1.0])
        save_figure(figure, tmp_path / (name + suffix))
        written.append((tmp_path / (name + suffix)).read_bytes())
    assert written[0] == written[1]
    assert written[0].startswith(begins)


PILLAR = [(1, 1), (3, 1), (3, 3), (1, 3)]


@pytest.mark.parametrize("ring", [PILLAR, PILLAR[::-1]], ids=["counter-clockwise", "clockwise"])
def test_a_pillar_has_the_colour_of_the_walls_whichever_way_its_ring_goes(ring):
    canvas = FigureCanvasAgg(Figure())
    ax = canvas.figure.subplots()
    draw_workspace(ax, Polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [ring]))
    canvas.draw()
    picture = np.asarray(canvas.buffer_rgba())

    def colour(x, y):
        column, row = ax.transData.transform((x, y))
        return picture[len(picture) - int(row), int(column)].tolist()

    assert colour(2.0, 2.1) == colour(-0.15, 2.1) != colour(0.5, 2.1)


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("floor", [box(0, 0, 7, 10), box(-20, 3, 20, 6), box(0, 0, 1, 30)])
def test_every_corner_is_in_the_picture_and_the_picture_is_filled(floor, turn):
    position, target = solids.camera_pose(floor, 0.5, turn=turn)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    up = np.cross(right, forward)
    x_min, y_min, x_max, y_max = floor.bounds
    corners = (
        np.array([[x, y, z] for x in (x_min, x_max) for y in (y_min, y_max) for z in (0.0, 0.5)]) - position
    )
    half = np.tan(np.radians(75) / 2)
    seen = (
        np.column_stack([corners @ right / (half * 4 / 3), corners @ up / half])
        / (corners @ forward)[:, None]
    )
    assert np.abs(seen).max() < 1.0
    assert np.abs(seen).max() > 0.8


FLOOR = Polygon([(0, 0), (4, 0), (4, 3), (2, 1), (0, 3)], [[(1, 0.5), (2, 0.5), (2, 0.8)]])


def area(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def test_meshes_have_the_areas_of_their_polygons_and_stand_between_their_heights():
    flat, slab = solids.flat_mesh([FLOOR], 0.3), solids.slab_mesh([FLOOR], 0.2, 0.3)
    assert area(flat) == pytest.approx(FLOOR.area)
    assert set(flat.vertices[:, 2]) == {0.3}
    assert area(slab) == pytest.approx(FLOOR.area + 0.1 * FLOOR.length)  # the top and all sides
    assert (slab.vertices[:, 2].min(), slab.vertices[:, 2].max()) == (0.2, 0.3)
    assert area(solids.joined([flat, slab])) == pytest.approx(2.0 * FLOOR.area + 0.1 * FLOOR.length)


def test_walls_stand_beside_the_floor_never_on_it():
    walls = solids.wall_polygons(FLOOR, 0.1)
    assert sum(wall.intersection(FLOOR).area for wall in walls) == pytest.approx(0.0, abs=1e-12)
    assert sum(wall.area for wall in walls) > FLOOR.exterior.length * 0.1


def test_a_thin_wall_between_two_rooms_is_drawn_whole():
    rooms = box(0, 0, 3, 2) | box(3.2, 0, 6, 2) | box(2, 0.8, 4, 1.2)
    within = [wall for wall in solids.wall_polygons(rooms, 0.08) if wall.contains(Point(3.1, 1.5))]
    assert len(within) == 1


def test_ring_lines_run_once_round_every_ring():
    start, end = solids.ring_lines([FLOOR, box(0, 0, 1, 1)], 0.2)
    assert start.shape == end.shape == (3, 5 + 3 + 4)
    assert np.linalg.norm(end - start, axis=0).sum() == pytest.approx(FLOOR.length + 4.0)


def test_a_ribbon_has_two_triangles_a_piece_in_the_order_of_the_line():
    points = np.column_stack([np.linspace(0.0, 3.0, 7), np.zeros(7)])
    mesh = solids.ribbon_mesh(points, 0.1, 0.02)
    assert mesh.faces.shape == (12, 3)
    assert area(mesh) == pytest.approx(0.3)
    middles = mesh.vertices[mesh.faces, 0].mean(axis=1).reshape(-1, 2).mean(axis=1)
    np.testing.assert_allclose(middles, points[:-1, 0] + 0.25)


def test_a_tube_has_the_surface_of_a_prism_and_stops_where_the_line_is_interrupted():
    points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [np.nan] * 3, [5.0, 1.0, 0.0], [5.0, 1.0, 3.0]])
    mesh = solids.tube_mesh(points, 0.01)
    # Six sides as broad as the radius; each of the two pieces is longer by the radius.
    assert area(mesh) == pytest.approx(6 * 0.01 * (5.0 + 2 * 0.01))
