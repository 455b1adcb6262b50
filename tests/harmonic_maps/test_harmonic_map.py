"""Maps beside other solvers and known ones; their accuracy, near walls too, and what is refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
from shapely import Point, Polygon, affinity, box

from coop_drake.errors import FieldError
from coop_drake.harmonic_maps import HarmonicMap, harmonic_map
from tests.support import domains

# The harmonic map of a rectangle by separation of variables: exact up to the truncated series.


def rectangle_map(width: float, height: float, points: np.ndarray, *, terms: int = 400) -> np.ndarray:
    """T at interior points (n, 2) of [0, width] x [0, height], the boundary angle 0 at the origin.

    The series of each side decays like exp(-n pi distance / side) in the distance from that side.
    """
    x, y = points.T
    rate = np.pi / (width + height)
    T = np.zeros(len(points), dtype=complex)
    # Side, its length, its angle at the start, coordinate along it, distance from it, extent across it.
    sides = (
        (width, 0.0, x, y, height),
        (height, rate * width, y, width - x, width),
        (width, np.pi, width - x, height - y, height),
        (height, np.pi + rate * width, height - y, x, width),
    )
    n = np.arange(1, terms + 1)[:, None]
    for length, start, along, across, extent in sides:
        k = n * np.pi / length
        # 2/L times the integral over (0, L) of exp(i (start + rate s)) sin(k s).
        coefficient = 2 / length * np.exp(1j * start) * k * (1 - (-1.0) ** n * np.exp(1j * rate * length))
        coefficient = coefficient / (k**2 - rate**2)
        decay = np.exp(-k * across) * (1 - np.exp(-2 * k * (extent - across))) / (1 - np.exp(-2 * k * extent))
        T += (coefficient * np.sin(k * along) * decay).sum(axis=0)
    return np.column_stack((T.real, T.imag))


# The cell of a plan that was hardest to map: narrow, with short edges and corners of every angle.


NAMED = {
    "square": domains.square(),
    "u_corridor": domains.u_corridor(),
    "warehouse": domains.warehouse(),
    "needle": domains.needle(10),
    "blade": domains.blade(350),
    "two_rooms": domains.two_rooms(0.01),
    "bevelled": domains.bevelled(1e-3),
    "rounded_room": domains.rounded_room(),
    "round_shelves": (domains.warehouse()[0].buffer(-0.15, quad_segs=3), Point(7.3, 5.3)),
    "maze": domains.maze(5),
}


@pytest.fixture(scope="module", params=NAMED)
def mapped(request):
    domain, goal = NAMED[request.param]
    return HarmonicMap(domain, goal)


def boundary_samples(region):
    """Points of the outer ring, dense towards every vertex, and where they belong."""
    ring = np.asarray(shapely.orient_polygons(region).exterior.coords)
    length = np.hypot(*np.diff(ring, axis=0).T)
    near = np.geomspace(1e-9, 0.5, 25)
    part = np.concatenate((near, 1 - near))
    s = np.concatenate([np.sum(length[:k]) + part * length[k] for k in range(len(length))])
    points = np.concatenate([a + part[:, None] * (b - a) for a, b in pairwise(ring)])
    angle = 2 * np.pi * s / length.sum()
    return points, np.column_stack((np.cos(angle), np.sin(angle)))


def test_rectangle_agrees_with_its_series():
    domain = Polygon([(0, 0), (1.7, 0), (1.7, 0.9), (0, 0.9)])
    points = domains.inside(domain, 300, clearance=0.03)
    T, _ = HarmonicMap(domain, Point(1, 0.5))(points)
    np.testing.assert_allclose(T, rectangle_map(1.7, 0.9, points), atol=2e-9)


def test_outer_ring_goes_to_the_circle_linearly_in_arc_length(mapped):
    points, expected = boundary_samples(mapped.region)
    T, J = mapped(points)
    offset = np.arctan2(T[0, 1], T[0, 0]) - np.arctan2(expected[0, 1], expected[0, 0])
    turn = np.array([[np.cos(offset), -np.sin(offset)], [np.sin(offset), np.cos(offset)]])
    np.testing.assert_allclose(T, expected @ turn.T, atol=1e-6)
    assert np.isfinite(J).all()


def test_jacobian_is_the_derivative(mapped):
    points = domains.inside(mapped.region, 300, clearance=0.01)
    points = points[:60] if len(points) > 60 else points
    h = 1e-4
    differences = []
    for axis in np.eye(2):
        f = [mapped(points + k * h * axis)[0] for k in (-2, -1, 1, 2)]
        differences.append((f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h))
    _, J = mapped(points)
    np.testing.assert_allclose(J, np.stack(differences, axis=-1), atol=1e-6 * np.abs(J).max())


@pytest.mark.parametrize(
    ("name", "finest"), [("warehouse", 1e-10), ("two_rooms", 1e-9), ("rounded_room", 1e-10), ("maze", 1e-9)]
)
def test_jacobian_a_centimetre_from_walls_is_that_of_a_finer_map(name, finest):
    domain, goal = NAMED[name]
    points, _ = domains.off_wall(domain, 0.01)
    points = points[shapely.contains_xy(domain.buffer(-0.0099), *points.T)][::7]
    plain, finer = HarmonicMap(domain, goal), HarmonicMap(domain, goal, tolerance=finest)
    assert finer.accuracy.unknowns > plain.accuracy.unknowns
    h = 5e-4
    differences = []
    for axis in np.eye(2):
        f = [finer(points + k * h * axis)[0] for k in (-3, -2, -1, 1, 2, 3)]
        differences.append((-f[0] + 9 * f[1] - 45 * f[2] + 45 * f[3] - 9 * f[4] + f[5]) / (60 * h))
    _, J = plain(points)
    np.testing.assert_allclose(J, np.stack(differences, axis=-1), atol=1e-6 * np.abs(J).max())


def test_polygons_of_many_sides_are_mapped_like_the_annulus():
    """The hole of radius a in the disk of radius b goes to 0: T = r (rho - a^2 / rho) / (b^2 - a^2) b."""
    errors = []
    for sides in (24, 48):
        angle = 2 * np.pi * np.arange(sides) / sides
        circle = np.column_stack((np.cos(angle), np.sin(angle)))
        domain = Polygon(2.0 * circle, [0.5 * circle])
        points = domains.inside(domain, 300, clearance=0.1)
        T, _ = HarmonicMap(domain, Point(1.2, 0.3))(points)
        radius = np.hypot(*points.T)
        expected = 2.0 * (radius - 0.25 / radius) / (4.0 - 0.25)
        errors.append(np.abs(np.hypot(*T.T) - expected).max())
    assert errors[1] < 0.3 * errors[0] < 1e-2


def test_vertices_go_exactly_where_they_belong():
    domain, goal = NAMED["warehouse"]
    harmonic_map = HarmonicMap(domain, goal)
    outer = np.asarray(shapely.orient_polygons(domain).exterior.coords)
    s = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(outer, axis=0).T))))
    T, _ = harmonic_map(outer)
    turned = np.unwrap(np.arctan2(T[:, 1], T[:, 0]))
    np.testing.assert_allclose(turned - turned[0], 2 * np.pi * s / s[-1], atol=1e-14)
    for hole in domain.interiors:
        T, J = harmonic_map(np.asarray(hole.coords))
        assert np.ptp(T, axis=0).max() == 0.0
        assert np.isfinite(J).all()


def test_map_has_the_mean_value_property(mapped):
    centres = domains.inside(mapped.region, 1000, clearance=0.05)
    centres = centres[:20]
    radius = 0.9 * shapely.distance(mapped.region.boundary, shapely.points(centres))
    angle = 2 * np.pi * np.arange(256) / 256
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    T, _ = mapped(centres[:, None] + radius[:, None, None] * circle)
    np.testing.assert_allclose(T.mean(axis=1), mapped(centres)[0], atol=1e-9)


def test_walls_are_the_limit_from_inside(mapped):
    walls, normals = domains.off_wall(mapped.region, 0.0)
    step = 1e-7
    T_wall, J_wall = mapped(walls)
    T_off, _ = mapped(walls + step * normals)
    predicted = T_wall + step * np.einsum("nij,nj->ni", J_wall, normals)
    np.testing.assert_allclose(T_off, predicted, atol=1e-9 + 1e-3 * step * np.abs(J_wall).max())


def test_coordinates_far_from_the_origin_do_no_harm():
    domain, goal = NAMED["u_corridor"]
    points = domains.inside(domain, 50, clearance=1e-3)
    far = HarmonicMap(affinity.translate(domain, 1e4, -2e4), affinity.translate(goal, 1e4, -2e4))
    np.testing.assert_allclose(
        far(points + np.array([1e4, -2e4]))[0], HarmonicMap(domain, goal)(points)[0], atol=1e-7
    )


ELL = Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])


def test_more_is_spent_where_more_is_asked():
    plain, fine = HarmonicMap(ELL, Point(0.5, 0.5)), HarmonicMap(ELL, Point(0.5, 0.5), tolerance=2e-10)
    assert fine.accuracy.unknowns > plain.accuracy.unknowns
    assert fine.accuracy.error_estimate <= 2e-10 < plain.accuracy.error_estimate


def test_refusal_names_the_place_of_the_largest_error():
    message = r"accurate to about .*; 1e-16 was asked for.*; the error is largest at \("
    with pytest.raises(FieldError, match=message):
        HarmonicMap(ELL, Point(0.5, 0.5), tolerance=1e-16)


@pytest.mark.parametrize("gap", [1e-6, 1e-7])
def test_a_gap_too_narrow_for_any_number_of_nodes_is_refused_at_the_first_attempt(monkeypatch, gap):
    attempts = []
    one_attempt = harmonic_map._attempt
    monkeypatch.setattr(harmonic_map, "_attempt", lambda *a: attempts.append(a[-1]) or one_attempt(*a))
    with pytest.raises(
        FieldError, match=r"and rounding alone may cost .*; the error is largest at \(1"
    ) as caught:
        HarmonicMap(*domains.two_rooms(gap))
    assert len(attempts) == 1
    place = [float(word) for word in str(caught.value).rpartition("(")[2].rstrip(") m").split(",")]
    assert box(0.98, 0.49, 1.12, 0.51).contains(Point(place))


def test_a_narrow_gap_that_does_no_harm_is_mapped():
    between_pillars = box(0, 0, 4, 3).difference(box(1, 1, 2, 2)).difference(box(2 + 1e-6, 1, 3, 2))
    accuracy = HarmonicMap(between_pillars, Point(3.5, 0.5)).accuracy
    assert accuracy.error_estimate <= 1e-8
    assert accuracy.condition * np.finfo(float).eps > 1e-8


def test_refusal_of_a_domain_too_fine_names_the_gap():
    comb = box(0, 0, 4, 1)
    for k in range(60):
        comb = comb.difference(box(0.05 + 0.066 * k, 0.2, 0.07 + 0.066 * k, 2))
    ragged = [(x, 0.0 if i % 2 else -1e-4) for i, x in enumerate(np.linspace(0, 4, 1200))]
    with pytest.raises(FieldError, match=r"unknowns, at most \d+ are allowed; the narrowest gap is"):
        HarmonicMap(comb.union(Polygon([*ragged, (4, 0.1), (0, 0.1)])), Point(2, 0.1))


def test_walls_vertices_and_the_outside_have_values(mapped):
    rings = [mapped.region.exterior, *mapped.region.interiors]
    vertices = np.concatenate([shapely.get_coordinates(ring) for ring in rings])
    walls, _ = domains.off_wall(mapped.region, 0.0, 11)
    hair = 1e-13 * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    for points in (vertices, walls, (vertices[:, None] + hair).reshape(-1, 2)):
        T, J = mapped(points)
        assert np.isfinite(T).all()
        assert np.isfinite(J).all()
        assert (np.hypot(*T.T) <= 1.0 + 1.5 * mapped.accuracy.error_estimate).all()
    for outside in (vertices - 0.7, 1e3 * vertices):
        assert all(np.isfinite(values).all() for values in mapped(outside))
