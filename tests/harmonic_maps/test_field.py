"""The velocity field, its streamlines, and pictures of maps."""

import numpy as np
import pytest
import shapely
from matplotlib.collections import LineCollection
from shapely import Point, box

from coop_drake.errors import FieldError
from coop_drake.harmonic_maps import HarmonicMap, VelocityField, trace_streamlines
from coop_drake.harmonic_maps.field import direction_error
from coop_drake.harmonic_maps.pictures import grid_figure, residual_figure, sample_boundary, streamline_figure
from tests.support import domains

# The velocity field: its direction and speed, which fields are refused, and straight streamlines.


@pytest.fixture(scope="module")
def harmonic_map():
    return HarmonicMap(*domains.u_corridor())


def test_direction_is_the_pulled_back_line_to_the_goal(harmonic_map):
    field = VelocityField(harmonic_map)
    points = domains.inside(harmonic_map.region, 100, clearance=1e-3)
    T, J = harmonic_map(points)
    newton = np.linalg.solve(J, (harmonic_map.goal_image - T)[..., None])[..., 0]
    expected = newton / np.linalg.norm(newton, axis=1)[:, None]
    velocity = np.array([field(p) for p in points])
    np.testing.assert_allclose(velocity / np.linalg.norm(velocity, axis=1)[:, None], expected, atol=1e-8)


def test_speed_is_bounded_and_proportional_near_the_goal(harmonic_map):
    field = VelocityField(harmonic_map, max_speed=0.7)
    goal = np.array(harmonic_map.goal.coords[0])
    assert field.slowdown_radius == pytest.approx(0.25)
    for distance in (1e-14, 1e-9, 1e-7, 1e-3, 0.2, 0.25, 0.4, 1.0):
        speed = np.hypot(*field(goal - [0.0, distance]))
        assert speed == pytest.approx(0.7 * min(1.0, distance / 0.25), rel=2e-2, abs=1e-14)
    assert (field(goal) == 0.0).all()


def test_field_is_continuous_towards_the_goal(harmonic_map):
    field = VelocityField(harmonic_map)
    goal = np.array(harmonic_map.goal.coords[0])
    for angle in np.linspace(0, 2 * np.pi, 7):
        out = np.array([np.cos(angle), np.sin(angle)])
        for distance in (1e-10, 2.4e-7, 2.6e-7, 1e-5):
            np.testing.assert_allclose(field(goal + distance * out) / distance * 0.25, -out, atol=1e-3)


def test_trial_points_outside_get_a_finite_velocity_that_leads_back(harmonic_map):
    field = VelocityField(harmonic_map)
    outside, normals = domains.off_wall(harmonic_map.region, -0.01)
    velocity = np.array([field(p) for p in outside])
    assert np.isfinite(velocity).all()
    assert (np.hypot(*velocity.T) <= 1.0 + 1e-12).all()
    assert (np.einsum("ni,ni->n", velocity, normals) > 0.0).all()
    vertices = np.asarray(harmonic_map.region.exterior.coords)
    assert np.isfinite([field(v) for v in vertices]).all()


def test_field_is_zero_in_a_goal_region_and_points_to_it_outside():
    goal = box(2.5, 0.5, 3.3, 1.2)
    field = VelocityField(HarmonicMap(box(0, 0, 4, 2), goal))
    assert (field([3, 1]) == 0.0).all()
    assert 0.0 < np.hypot(*field([2.5 - 1e-4, 0.9])) < 1e-3
    assert field([2.4, 0.9])[0] > 0.0
    assert np.hypot(*field([1.0, 1.0])) == pytest.approx(1.0)


def test_many_points_get_what_each_gets(harmonic_map):
    field = VelocityField(harmonic_map, max_speed=0.6)
    points = domains.inside(harmonic_map.region, 40)
    np.testing.assert_array_equal(field(points), [field(p) for p in points])
    assert field(points[:6].reshape(2, 3, 2)).shape == (2, 3, 2)
    with pytest.raises(FieldError, match="shape"):
        field([1.0, 2.0, 3.0])


def test_inside_of_a_frame_is_not_in_the_goal():
    frame = box(0.5, 0.2, 3.5, 1.8).difference(box(1, 0.6, 3, 1.4))
    field = VelocityField(HarmonicMap(box(0, 0, 4, 2), frame))
    assert np.hypot(*field([2.0, 1.0])) > 0.5
    assert (field([0.8, 1.0]) == 0.0).all()
    starts = domains.inside(box(1, 0.6, 3, 1.4), 100)
    assert trace_streamlines(field, starts).arrived.all()


AISLE = 0.3


def three_shelves(length):
    """Three shelves one above the other, the aisles between them as wide as high."""
    shelves = [box(1, y, 1 + length, y + AISLE) for y in (AISLE, 3 * AISLE, 5 * AISLE)]
    return box(0, 0, 2 + length, 7 * AISLE).difference(shapely.union_all(shelves))


def error_at(harmonic_map, points):
    return direction_error(
        harmonic_map, points, shapely.distance(harmonic_map.region.boundary, shapely.points(points))
    )


def centred_goal(length):
    """In the middle above the shelves: by symmetry their images are in line with it."""
    return Point(1 + 0.5 * length, 6.5 * AISLE)


def test_a_long_aisle_in_line_with_the_goal_is_refused_by_its_place():
    harmonic_map = HarmonicMap(three_shelves(8.0), centred_goal(8.0), tolerance=1e-6)
    with pytest.raises(FieldError, match=r"not known in \d+ % of the region.*join the holes") as caught:
        VelocityField(harmonic_map)
    place = Point(*map(float, str(caught.value).split("at (")[1].split(")")[0].split(", ")))
    assert harmonic_map.region.contains(place)
    assert 1.0 < place.x < 9.0
    assert place.y < 6 * AISLE


def test_a_goal_in_the_middle_of_a_leaf_is_no_place_where_the_direction_is_unknown():
    goal = Point(3.4, 3.6)
    harmonic_map = HarmonicMap(box(2.7, 2.7, 4.3, 4.3), goal)
    leaves = harmonic_map.solution.arrays.leaf_square[:, :2] + harmonic_map.solution.centre
    assert shapely.distance(goal, shapely.points(leaves)).min() < 1e-9
    assert VelocityField(harmonic_map)(goal.coords[0]).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("domain", "goal"),
    [
        (three_shelves(2.0), centred_goal(2.0)),
        (three_shelves(8.0), Point(5.4, 6.5 * AISLE)),
        domains.warehouse(),
    ],
    ids=["short aisles", "goal beside the middle", "warehouse"],
)
def test_directions_err_by_no_more_than_the_bound(domain, goal):
    rough, fine = (HarmonicMap(domain, goal, tolerance=tolerance) for tolerance in (1e-5, 3e-9))
    points = domains.inside(domain, 1500, clearance=0.02)
    here, there = VelocityField(rough)(points), VelocityField(fine)(points)
    turn = np.arctan2(here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0], np.sum(here * there, axis=1))
    known = error_at(rough, points) < 0.1
    assert known.mean() > 0.99
    assert (np.abs(turn[known]) <= 1.1 * error_at(rough, points)[known] + 1e-7).all()


def test_the_bound_says_where_directions_are_not_known():
    region, goal = three_shelves(8.0), centred_goal(8.0)
    rough, fine = (HarmonicMap(region, goal, tolerance=tolerance) for tolerance in (1e-6, 1e-8))
    points = domains.inside(region, 2000, clearance=0.02)

    here, there = (direction(harmonic_map, points) for harmonic_map in (rough, fine))
    wrong = np.sum(here * there, axis=1) < 0.0
    assert wrong.sum() > 20
    assert (error_at(rough, points)[wrong] > 1.0).all()


def direction(harmonic_map, points):
    T, J = harmonic_map(points)
    x, y = (harmonic_map.goal_image - T).T
    return np.column_stack((J[:, 1, 1] * x - J[:, 0, 1] * y, J[:, 0, 0] * y - J[:, 1, 0] * x))


@pytest.fixture(scope="module")
def u_field():
    return VelocityField(HarmonicMap(*domains.u_corridor()))


@pytest.fixture(scope="module")
def streamlines(u_field):
    return trace_streamlines(u_field, domains.inside(u_field.harmonic_map.region, 300, clearance=0.01))


def test_each_begins_at_its_start_and_ends_at_the_goal(u_field, streamlines):
    goal = np.array(u_field.harmonic_map.goal.coords[0])
    starts = domains.inside(u_field.harmonic_map.region, 300, clearance=0.01)
    np.testing.assert_array_equal([path[0] for path in streamlines.paths], starts)
    ends = np.array([path[-1] for path in streamlines.paths])
    assert streamlines.arrived.all()
    assert np.hypot(*(ends - goal).T).max() <= 0.01 * u_field.slowdown_radius


def test_images_run_straight_to_the_goal(u_field, streamlines):
    harmonic_map = u_field.harmonic_map
    for path in streamlines.paths:
        away = (harmonic_map(path)[0] - harmonic_map.goal_image) @ [1.0, 1.0j]
        off_line = np.abs(np.imag(np.conj(away[0]) * away)) / np.abs(away[0])
        assert off_line.max() < 0.05
        assert (np.diff(np.abs(away)) < 0.0).all()


def test_time_of_a_straight_walk_is_its_length_and_the_logarithm_of_its_end():
    u_field = VelocityField(HarmonicMap(box(-1, -1, 1, 1), Point(0, 0)), slowdown_radius=0.25)
    near, far = trace_streamlines(u_field, [[0.24, 0.0], [0.9, 0.0]]).times
    assert near == pytest.approx(0.25 * np.log(0.24 / 0.0025), rel=5e-3)
    assert far == pytest.approx((0.9 - 0.25) + 0.25 * np.log(100.0), rel=0.02)


def test_too_few_steps_leave_the_way_unfinished(u_field):
    lost = trace_streamlines(u_field, [[2.5, 2.5]], max_steps=5)
    assert not lost.arrived[0]
    assert np.isinf(lost.times[0])
    assert len(lost.paths[0]) == 6


# Pictures of maps: what is drawn, and samples of the boundary that go where they belong.


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
