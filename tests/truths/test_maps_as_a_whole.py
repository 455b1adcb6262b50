"""What loops say of a map: it is one to one, and nothing flows into a hole."""

import numpy as np
import pytest
import shapely
from numpy.polynomial.legendre import leggauss
from shapely import Point, Polygon

from coop_drake.harmonic_maps import HarmonicMap
from tests.support import domains


@pytest.fixture(scope="module", params=[1, 2, 3])
def mapped(request):
    room = domains.random_room(np.random.default_rng(request.param), holes=4)
    return HarmonicMap(room, Point(shapely.maximum_inscribed_circle(room).coords[0]))


def circles(region, count):
    """Circles in a region, some of them round holes of it; shape (1501, 2) each, closed."""
    rng, filled = np.random.default_rng(0), Polygon(region.exterior)
    turn = np.linspace(0.0, 2.0 * np.pi, 1501)[:, None]
    found = []
    while len(found) < count:
        circle = rng.uniform(-1.0, 1.0, 2) + rng.uniform(0.1, 0.8) * np.hstack((np.cos(turn), np.sin(turn)))
        line = shapely.linestrings(circle)
        if filled.contains(line) and region.boundary.distance(line) > 0.01:
            found.append(circle)
    return found


def windings(curve, points):
    """How often a closed curve winds round every point, and the largest angle of its steps [rad]."""
    to_curve = (curve @ [1.0, 1.0j]) - (points @ [1.0, 1.0j])[:, None]
    steps = np.angle(to_curve[:, 1:] / to_curve[:, :-1])
    return np.rint(steps.sum(axis=1) / (2.0 * np.pi)), np.abs(steps).max()


def test_the_image_of_a_circle_winds_once_round_what_comes_from_inside(mapped):
    points = domains.inside(mapped.region, 300)
    for circle in circles(mapped.region, 8):
        clear = shapely.distance(shapely.linestrings(circle), shapely.points(points)) > 0.02
        inside = shapely.contains_xy(Polygon(circle), *points[clear].T)
        count, step = windings(mapped(circle)[0], mapped(points[clear])[0])
        assert 0 < inside.sum() < len(inside)
        assert step < 0.5 * np.pi
        np.testing.assert_array_equal(count, inside)


def test_nothing_flows_into_a_hole(mapped):
    """Where a hole goes is fixed by this: integrated round it, the derivative of T across the way is zero."""
    walls, holes = mapped.region.boundary, [Polygon(ring) for ring in mapped.region.interiors]
    assert holes
    for hole in holes:
        room = hole.distance(walls.difference(hole.boundary))
        way = shapely.segmentize(hole.buffer(0.4 * room).exterior, 0.2 * room)
        flux, across = flux_through(mapped, shapely.get_coordinates(way))
        # The error of T is harmonic and at most the estimated one: so steep it can be at this distance.
        error = 4.0 * mapped.accuracy.error_estimate / (np.pi * walls.distance(way)) * way.length
        assert np.hypot(*flux) < error
        assert error < 1e-4 * across


def flux_through(harmonic_map, ring):
    """Integral of J n along a closed ring, shape (2,), and that of its magnitude."""
    node, weight = leggauss(12)
    step = np.diff(ring, axis=0)
    points = ring[:-1, None] + 0.5 * (1.0 + node)[:, None] * step[:, None]
    normal = np.column_stack((step[:, 1], -step[:, 0]))  # as long as its piece
    flow = np.einsum("psij,pj->psi", harmonic_map(points)[1], normal) * 0.5 * weight[:, None]
    return flow.sum(axis=(0, 1)), np.linalg.norm(flow, axis=-1).sum()
