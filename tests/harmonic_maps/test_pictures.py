"""Pictures of maps: what is drawn, and samples of the boundary that go where they belong."""

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection
from shapely import Point, box

from coop_drake.drawing import save_figure
from coop_drake.harmonic_maps import HarmonicMap, VelocityField
from coop_drake.harmonic_maps.field import trace_streamlines
from coop_drake.harmonic_maps.pictures import grid_figure, residual_figure, sample_boundary, streamline_figure
from tests.support import domains


@pytest.fixture(scope="module")
def picture_map():
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


def test_the_grid_stays_in_the_cell_and_its_image_in_the_disk(picture_map):
    cell, disk = grid_figure(picture_map, lines=10).axes
    room = picture_map.region.buffer(0.01)  # walls are drawn from sample to sample, across the corners
    assert all(room.covers(shapely.linestrings(line)) for line in lines(cell))
    assert max(np.linalg.norm(line, axis=1).max() for line in lines(disk)) <= 1.0 + 1e-7
    assert len(lines(cell)) == len(lines(disk)) > 20


def test_corners_have_the_same_letters_in_the_disk_where_those_of_the_goal_coincide(picture_map):
    cell, disk = grid_figure(picture_map, lines=4).axes
    assert letters(cell) == list("ABCDEFGH")
    assert sorted("".join(letters(disk))) == letters(cell)
    (together,) = [text for text in letters(disk) if len(text) > 1]
    corners = {text.get_text(): text.xy for text in cell.texts}
    assert all(picture_map.goal.boundary.distance(Point(corners[letter])) < 1e-9 for letter in together)
    assert len(together) == 4


def test_streamlines_are_straight_in_the_disk(picture_map):
    starts = [[0.3, 0.3], [1.0, 2.5], [3.0, 3.5]]
    _, disk = streamline_figure(picture_map, trace_streamlines(VelocityField(picture_map), starts).paths).axes
    for line in lines(disk)[:3]:
        way = line[-1] - line[0]
        normal = np.array([-way[1], way[0]]) / np.hypot(*way)
        assert np.abs((line - line[0]) @ normal).max() < 0.01


def test_the_residual_stays_under_the_drawn_bound(picture_map):
    (ax,) = residual_figure(picture_map, 1e-7).axes
    outer, hole, tolerance, bound = (np.asarray(line.get_ydata(), dtype=float) for line in ax.lines[:4])
    assert tolerance[0] == 1e-7
    assert bound[0] == picture_map.accuracy.error_estimate
    assert outer.max() <= bound[0]
    assert hole.max() <= 2.0 * bound[0]


def test_the_same_map_gives_the_same_picture(picture_map, tmp_path):
    for name in ("a.png", "b.png"):
        save_figure(grid_figure(picture_map, lines=6), tmp_path / name, dpi=50)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


HALL = box(0, 0, 6, 4).difference(box(2, 1, 3, 3))


@pytest.mark.parametrize(
    "goal", [Point(5, 2), box(5, 1, 6, 3), box(4, 1.5, 5, 2.5)], ids=["point", "arc", "hole"]
)
def test_the_residual_stays_below_the_estimate(goal):
    mapped = HarmonicMap(HALL, goal, tolerance=1e-7)
    samples = sample_boundary(mapped, 33)
    # The mean of a hole's samples may be off by as much as a sample.
    assert samples.residual.max() <= 2.0 * mapped.accuracy.error_estimate
    assert samples.residual.shape == samples.arc_length.shape == samples.ring.shape


def test_samples_lie_on_the_walls_and_arc_length_runs_through_all_rings():
    mapped = HarmonicMap(HALL, Point(5, 2), tolerance=1e-7)
    samples = sample_boundary(mapped, 33)
    assert shapely.distance(HALL.boundary, shapely.points(samples.points)).max() < 1e-12
    assert (np.diff(samples.arc_length) > 0.0).all()
    assert samples.arc_length[-1] == pytest.approx(HALL.length, abs=0.01)
    assert list(np.unique(samples.ring)) == [0, 1]
    np.testing.assert_allclose(np.diff(samples.vertex_arc_length)[:3], [6.0, 4.0, 6.0])


def test_walls_go_round_the_circle_in_proportion_to_their_length():
    mapped = HarmonicMap(*domains.u_corridor(), tolerance=1e-7)
    samples = sample_boundary(mapped)
    turns = np.unwrap(np.arctan2(*samples.expected.T[::-1])) / (2.0 * np.pi)
    along = (samples.arc_length - samples.arc_length[0]) / mapped.region.length
    np.testing.assert_allclose(turns - turns[0], along)
    np.testing.assert_allclose(samples.vertex_images, mapped(samples.vertices)[0], atol=1e-6)
