import numpy as np
import pytest
from shapely import Point, Polygon, box

from coop_drake.errors import FieldError
from coop_drake.fields import HarmonicMap, VelocityField, trace_streamlines
from tests.support import domains


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


def test_radius_of_slowing_down_can_be_chosen(harmonic_map):
    field = VelocityField(harmonic_map, slowdown_radius=0.01)
    goal = np.array(harmonic_map.goal.coords[0])
    assert np.hypot(*field(goal + np.array([0.0, 0.02]))) == pytest.approx(1.0)
    assert np.hypot(*field(goal + np.array([0.0, 0.005]))) == pytest.approx(0.5)


@pytest.mark.parametrize("name", ["square", "u_corridor", "warehouse", "rounded_room"])
def test_outer_walls_push_inwards(name):
    mapped = HarmonicMap(*getattr(domains, name)())
    field = VelocityField(mapped)
    for distance in (0.0, 1e-3):
        points, normals = domains.off_wall(Polygon(mapped.region.exterior), distance)
        inwards = [field(p) @ n for p, n in zip(points, normals, strict=True)]
        assert min(inwards) > 0.0


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
    field = VelocityField(HarmonicMap(box(0, 0, 4, 2), frame, inside=Point(2, 1)))
    assert np.hypot(*field([2.0, 1.0])) > 0.5
    assert (field([0.8, 1.0]) == 0.0).all()
    starts = domains.inside(box(1, 0.6, 3, 1.4), 100)
    assert trace_streamlines(field, starts).arrived.all()
