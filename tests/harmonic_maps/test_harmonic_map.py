"""Maps beside other solvers and known ones; their accuracy, near walls too, and what is refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
from shapely import Point, Polygon, affinity, box

from coop_drake.errors import FieldError, UnmappableError
from coop_drake.geometry import BoundaryDistance
from coop_drake.harmonic_maps import HarmonicMap, harmonic_map
from coop_drake.harmonic_maps.pictures import sample_boundary
from tests.support import domains
from tests.support.domains import inside
from tests.support.single_layer import SingleLayer

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


# Cells of plans that were hardest to map: narrow, with short edges and corners of every angle.

NEXT_TO_THE_GOAL = (
    Polygon([
        (4.20956, 0.95223), (4.20956, 1.36779), (4.60223, 1.51809), (5.02729, 1.51809),
        (5.02729, 1.64838), (5.03998, 1.70434), (5.34027, 1.91319), (5.68565, 2.03363),
        (6.05345, 2.03363), (6.06073, 2.05088), (6.1379, 2.10455), (6.1379, 2.29432),
        (6.48599, 2.55223), (6.70956, 2.55223), (6.70956, 7.0961), (5.37037, 7.0961),
        (5.37037, 2.26008), (4.97772, 2.10979), (4.47271, 2.10979), (4.47271, 1.95162),
        (4.46002, 1.89566), (4.15973, 1.68681), (3.81435, 1.56637), (3.46407, 1.56637),
        (3.43161, 1.5438), (3.43161, 1.35403), (3.08351, 1.0961), (2.03506, 1.0961),
        (1.88438, 1.29946), (1.80113, 1.45793), (1.73141, 1.64006), (1.70956, 1.75533),
        (1.70956, 4.893), (1.37037, 4.76581), (1.37037, 0.95223),
    ]),
    Point(6, 6),
)  # fmt: skip

LONG_WAY_ROUND = (
    Polygon([
        (3.9684, 1.52936), (3.72167, 1.52936), (3.44906, 1.15202), (2.44695, 1.15202),
        (2.32427, 1.24065), (2.2208, 1.35351), (2.12897, 1.47604), (2.0649, 1.61213),
        (2.0649, 4.96894), (1.7684, 4.82936), (1.42999, 4.70245), (1.24906, 4.45202),
        (1.11605, 4.40214), (1.11605, 1.0101), (4.5649, 1.0101), (4.5649, 1.21504),
        (4.98109, 1.41097), (5.02453, 1.42037), (5.02453, 1.646), (5.22807, 1.92775),
        (5.5316, 2.07064), (5.79067, 2.07064), (5.86354, 2.18859), (6.16806, 2.6101),
        (6.67474, 2.6101), (6.86994, 2.45642), (7.0382, 2.23567), (7.0649, 2.24469),
        (7.0649, 7.15202), (5.11605, 7.15202), (5.11605, 2.47015), (4.64558, 2.24866),
        (4.47547, 2.17963), (4.47547, 1.954), (4.27193, 1.67225),
    ]),
    Point(6, 6),
)  # fmt: skip

TWO_ROOMS = (
    Polygon([
        (4.75219, 6.04268), (4.76621, 6.0378), (4.89787, 5.91524), (4.9303, 5.81164),
        (4.9303, 5.34465), (4.90395, 5.25712), (4.84778, 5.18902), (4.97065, 5.09758),
        (5.10228, 5.0714), (5.23391, 5.09758), (5.3455, 5.17214), (5.42006, 5.28373),
        (5.46705, 5.43912), (5.46296, 5.61024), (5.46296, 5.98529), (5.3481, 5.99791),
        (5.30782, 6.02968), (5.29938, 6.77724), (5.34549, 7.19715), (5.38869, 7.22483),
        (5.54096, 7.22655), (5.54096, 7.59939), (5.55822, 7.60066), (5.55822, 7.63774),
        (5.60491, 7.6782), (5.60491, 7.87518), (5.63967, 7.96342), (5.71194, 8.0429),
        (5.81578, 8.08078), (5.92962, 8.08078), (5.89434, 8.25815), (5.75675, 8.46408),
        (5.55082, 8.60167), (5.30792, 8.64998), (5.06502, 8.60167), (4.8591, 8.46408),
        (4.80395, 8.35712), (4.72125, 8.25684), (4.68591, 8.07918), (4.86519, 8.03468),
        (4.95886, 7.96915), (5.02586, 7.86979), (5.08936, 7.69568), (5.08936, 7.20812),
        (5.0602, 7.1125), (5.13165, 7.06476), (5.11214, 6.80495), (4.92812, 6.24394),
        (4.84643, 6.18936),
    ]),
    Point(5, 8),
)  # fmt: skip

REAL_CELLS = {"next to the goal": NEXT_TO_THE_GOAL, "long way round": LONG_WAY_ROUND, "two rooms": TWO_ROOMS}


NAMED = {
    "square": domains.square(),
    "u_corridor": domains.u_corridor(),
    "warehouse": domains.warehouse(),
    "needle": domains.needle(10),
    "blade": domains.blade(350),
    "two_rooms": domains.two_rooms(0.01),
    "bevelled": domains.bevelled(1e-3),
    "rounded_room": domains.rounded_room(),
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


def test_polygon_of_many_sides_is_mapped_like_the_disk():
    """On the inscribed polygon of n sides T differs from p / r by O(n^-2)."""
    errors = []
    for sides in (40, 80):
        angle = 2 * np.pi * np.arange(sides) / sides
        ring = 2.0 * np.column_stack((np.cos(angle), np.sin(angle)))
        points = domains.inside(Polygon(ring), 200, clearance=0.2)
        T, J = HarmonicMap(Polygon(ring), Point(0.3, 0.2))(points)
        turn = (T[0] @ points[0] + 1j * (points[0, 0] * T[0, 1] - points[0, 1] * T[0, 0])) / (
            points[0] @ points[0]
        )
        turn /= abs(turn)
        z = (T[:, 0] + 1j * T[:, 1]) / turn
        errors.append(np.abs(z - 0.5 * (points[:, 0] + 1j * points[:, 1])).max())
        np.testing.assert_allclose(np.linalg.det(J), 0.25, atol=10 / sides**2)
    assert errors[1] < 0.3 * errors[0] < 2e-3


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


def test_shape_of_the_points_is_kept():
    harmonic_map = HarmonicMap(*NAMED["square"])
    T, J = harmonic_map([[[0.1, 0.2]], [[0.3, 0.4]]])
    assert T.shape == (2, 1, 2)
    assert J.shape == (2, 1, 2, 2)
    assert harmonic_map([0.1, 0.2])[0] == pytest.approx(T[0, 0])


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


def test_refusal_names_the_corner_at_fault():
    message = r"accurate to about .*; 1e-16 was asked for.*; at fault is the corner at \("
    with pytest.raises(FieldError, match=message):
        HarmonicMap(ELL, Point(0.5, 0.5), tolerance=1e-16)


@pytest.mark.parametrize("gap", [1e-6, 1e-7])
def test_a_gap_too_narrow_for_any_number_of_nodes_is_refused_at_the_first_attempt(monkeypatch, gap):
    attempts = []
    one_attempt = harmonic_map._attempt
    monkeypatch.setattr(harmonic_map, "_attempt", lambda *a: attempts.append(a[-1]) or one_attempt(*a))
    with pytest.raises(
        UnmappableError, match=r"and rounding alone may cost .*; at fault is the gap of"
    ) as caught:
        HarmonicMap(*domains.two_rooms(gap))
    assert len(attempts) == 1
    assert caught.value.width == pytest.approx(gap, rel=0.01)
    assert box(0.98, 0.49, 1.12, 0.51).contains(Point(caught.value.place))


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
    with pytest.raises(FieldError, match=r"unknowns, at most \d+ are allowed; narrowest is the"):
        HarmonicMap(comb.union(Polygon([*ragged, (4, 0.1), (0, 0.1)])), Point(2, 0.1))


HALL = box(0, 0, 4, 2)
WAREHOUSE, GOAL = domains.warehouse()
SHELVES, SHELF_GOAL = domains.long_shelves(2)
WITH_WALLS = {
    "square": domains.square(),
    "U corridor": domains.u_corridor(),
    "warehouse": (WAREHOUSE, GOAL),
    "maze": domains.maze(6),
    "Minkowski, mitre": (WAREHOUSE.buffer(-0.15, join_style="mitre"), GOAL),
    "Minkowski, round": (WAREHOUSE.buffer(-0.15, quad_segs=3), GOAL),
    "goal on the outer ring": (WAREHOUSE, box(6.5, 4.8, 8, 6)),
    "goal in the interior": (WAREHOUSE, box(7, 5.2, 7.8, 5.8)),
    "long shelves": (SHELVES, SHELF_GOAL),
    "holes 1 cm apart": (
        HALL.difference(box(1, 0.5, 1.995, 1.5)).difference(box(2.005, 0.5, 3, 1.5)),
        Point(3.5, 1),
    ),
    "needle": domains.needle(10),
    "blade": domains.blade(350),
}


@pytest.fixture(scope="module", params=WITH_WALLS)
def walled(request):
    domain, goal = WITH_WALLS[request.param]
    return HarmonicMap(domain, goal, tolerance=1e-6)


def grid(region, count):
    """Points of a square grid in a region, a little more than ``count``."""
    x0, y0, x1, y1 = region.bounds
    h = np.sqrt(region.area / (1.05 * count))
    x, y = np.meshgrid(np.arange(x0 + 0.5 * h, x1, h), np.arange(y0 + 0.5 * h, y1, h))
    points = np.column_stack((x.ravel(), y.ravel()))
    return points[shapely.contains_xy(region, *points.T)]


def test_disk_is_kept_and_nothing_is_folded(walled):
    points = grid(walled.region, 20_000)
    assert len(points) >= 20_000
    close, _ = domains.off_wall(walled.region, 1e-3, 25)
    close = close[shapely.contains_xy(walled.region, *close.T)]
    everywhere = np.concatenate((points, close))
    T, J = walled(everywhere)
    assert (np.hypot(*T.T) < 1.0).all()
    # The error of T is harmonic and bounded: its gradient is at most 4 / pi times bound over distance.
    distance = BoundaryDistance(walled.region).batch(everywhere)
    J_error = np.sqrt(2.0) * 4.0 / np.pi * walled.accuracy.error_estimate / distance
    det_error = 2.0 * np.linalg.norm(J, 2, axis=(1, 2)) * J_error + J_error**2
    det = np.linalg.det(J)
    assert (det > -det_error).all()
    certain = np.abs(det) > det_error
    assert (det[certain] > 0.0).all()
    assert np.mean(certain) > 0.6


def test_walls_vertices_and_the_outside_have_values(walled):
    rings = [walled.region.exterior, *walled.region.interiors]
    vertices = np.concatenate([shapely.get_coordinates(ring) for ring in rings])
    walls, _ = domains.off_wall(walled.region, 0.0, 11)
    hair = 1e-13 * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    for points in (vertices, walls, (vertices[:, None] + hair).reshape(-1, 2)):
        T, J = walled(points)
        assert np.isfinite(T).all()
        assert np.isfinite(J).all()
        assert (np.hypot(*T.T) <= 1.0 + 1.5 * walled.accuracy.error_estimate).all()
    for outside in (vertices - 0.7, 1e3 * vertices):
        assert all(np.isfinite(values).all() for values in walled(outside))


AGAINST_SINGLE_LAYER = {
    "square": (*domains.square(), 40),
    "U corridor": (*domains.u_corridor(), 40),
    "warehouse": (WAREHOUSE, GOAL, 40),
    "maze": (*domains.maze(5), 80),
    "Minkowski, mitre": (WAREHOUSE.buffer(-0.15, join_style="mitre"), GOAL, 40),
    "Minkowski, round": (WAREHOUSE.buffer(-0.15, quad_segs=3), GOAL, 20),
    "goal on the outer ring": (WAREHOUSE, box(6.5, 4.8, 8, 6), 40),
}
ACCURACY = 4e-4  # of the oracle, whose elements are constant


SLOW = {"maze", "Minkowski, round"}


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=[pytest.mark.slow] if n in SLOW else []) for n in AGAINST_SINGLE_LAYER],
)
def test_map_and_jacobian_agree_with_a_single_layer(name):
    domain, goal, elements = AGAINST_SINGLE_LAYER[name]
    harmonic_map = HarmonicMap(domain, goal, tolerance=1e-6)
    region = harmonic_map.region
    collapsed = goal if isinstance(goal, Polygon) else None
    oracle = SingleLayer(region, elements=elements, collapsed=collapsed)
    points = domains.inside(region, 600, clearance=0.02)
    T, _ = harmonic_map(points)
    assert np.hypot(*(T - oracle(points)).T).max() < ACCURACY
    # A harmonic error of that size changes by its size within the distance to the wall.
    deep = domains.inside(region, 600, clearance=0.1)
    slack = 4.0 / np.pi * np.sqrt(2.0) * ACCURACY / 0.1
    assert np.linalg.norm(harmonic_map(deep)[1] - oracle.jacobian(deep), axis=(1, 2)).max() < slack


@pytest.mark.parametrize(
    "domain",
    [
        domains.u_corridor()[0],
        Polygon([(0, 0), (1, 0), (0.3, 0.8)]),
        Polygon([(0, 0), (1, 0.1), (1.2, 0.9), (0.5, 0.6), (-0.1, 1)]),
        box(0, 0, 2, 2).difference(box(0.7, 0.8, 1.2, 1.3)),
    ],
    ids=["corridor", "triangle", "pentagon", "with a hole"],
)
def test_the_oracle_converges_to_the_map(domain):
    points = domains.inside(domain, 300, clearance=0.1)
    T, _ = HarmonicMap(domain, domain.representative_point(), tolerance=1e-8)(points)
    errors = [np.abs(SingleLayer(domain, elements=n)(points) - T).max() for n in (10, 30, 90)]
    assert errors[1] < errors[0] / 3.0
    assert errors[2] < errors[1] / 3.0
    assert errors[2] < 1e-5


@pytest.mark.parametrize("question", REAL_CELLS.values(), ids=REAL_CELLS)
def test_a_real_cell_is_mapped_to_1e_8(question):
    mapped = HarmonicMap(*question, tolerance=1e-8)
    assert mapped.accuracy.error_estimate <= 1e-8
    assert sample_boundary(mapped, 301).residual.max() <= 1.5e-8
    assert np.linalg.det(mapped(inside(mapped.region, 2_000))[1]).min() > 0.0


def test_the_same_question_has_the_same_map_to_the_last_bit():
    domain, points = box(0.0, 0.0, 2.0, 1.0).difference(box(0.8, 0.4, 1.1, 0.6)), [[0.3, 0.2], [1.6, 0.9]]
    first, second = (HarmonicMap(domain, Point(1.7, 0.5))(points) for _ in range(2))
    assert [part.tobytes() for part in first] == [part.tobytes() for part in second]
