"""Pictures of maps: what is drawn, and that the same map gives the same picture."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection
from shapely import Point, box

from coop_drake.drawing import save_figure
from coop_drake.fields import HarmonicMap, VelocityField
from coop_drake.fields.pictures import grid_figure, residual_figure, streamline_figure
from coop_drake.fields.streamlines import trace_streamlines


@pytest.fixture(scope="module")
def mapped():
    return HarmonicMap(box(0, 0, 6, 4).difference(box(2, 1, 3, 3)), box(5, 1, 6, 3), tolerance=1e-7)


def lines(ax):
    return [
        segment
        for drawn in ax.collections
        if isinstance(drawn, LineCollection)
        for segment in drawn.get_segments()
    ]


def letters(ax):
    return [text.get_text() for text in ax.texts]


def test_the_grid_stays_in_the_cell_and_its_image_in_the_disk(mapped):
    cell, disk = grid_figure(mapped, lines=10).axes
    room = mapped.region.buffer(0.01)  # walls are drawn from sample to sample, across the corners
    assert all(room.covers(shapely.linestrings(line)) for line in lines(cell))
    assert max(np.linalg.norm(line, axis=1).max() for line in lines(disk)) <= 1.0 + 1e-7
    assert len(lines(cell)) == len(lines(disk)) > 20


def test_corners_have_the_same_letters_in_the_disk_where_those_of_the_goal_coincide(mapped):
    cell, disk = grid_figure(mapped, lines=4).axes
    assert letters(cell) == list("ABCDEFGH")
    assert sorted("".join(letters(disk))) == letters(cell)
    (together,) = [text for text in letters(disk) if len(text) > 1]
    corners = {text.get_text(): text.xy for text in cell.texts}
    assert all(mapped.goal.boundary.distance(Point(corners[letter])) < 1e-9 for letter in together)
    assert len(together) == 4


def test_streamlines_are_straight_in_the_disk(mapped):
    starts = [[0.3, 0.3], [1.0, 2.5], [3.0, 3.5]]
    _, disk = streamline_figure(mapped, trace_streamlines(VelocityField(mapped), starts).paths).axes
    for line in lines(disk)[:3]:
        way = line[-1] - line[0]
        normal = np.array([-way[1], way[0]]) / np.hypot(*way)
        assert np.abs((line - line[0]) @ normal).max() < 0.01


def test_the_residual_stays_under_the_drawn_bound(mapped):
    (ax,) = residual_figure(mapped, 1e-7).axes
    outer, hole, tolerance, bound = (np.asarray(line.get_ydata(), dtype=float) for line in ax.lines[:4])
    assert tolerance[0] == 1e-7
    assert bound[0] == mapped.accuracy.error_estimate
    assert outer.max() <= bound[0]
    assert hole.max() <= 2.0 * bound[0]


def test_the_same_map_gives_the_same_picture(mapped, tmp_path):
    for name in ("a.png", "b.png"):
        save_figure(grid_figure(mapped, lines=6), tmp_path / name, dpi=50)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
