"""Spikes are cut off inward, and what was too sharp to map can be mapped."""

import numpy as np
import pytest
from shapely import Point, Polygon, box

from coop_drake.errors import FieldError, UnmappableError
from coop_drake.fields import HarmonicMap, blunted
from coop_drake.geometry import sharpest_angle
from tests.support import domains

HALL = box(0, 0, 4, 2)
SPIKED = HALL.difference(Polygon([(1, 2.1), (1.001, 0.5), (1.002, 2.1)])).union(
    Polygon([(4, 1), (4.9, 1.001), (4, 1.002)])
)
SHAPES = {
    "needle of 5 degrees": domains.needle(5),
    "needle of 0.1 degrees": domains.needle(0.1),
    "blade of 5 degrees": domains.blade(355),
    "blade of 0.1 degrees": domains.blade(359.9),
    "both kinds": (SPIKED, Point(3.5, 1)),
    "a hole's tip": (
        HALL.difference(Polygon([(1, 1), (2.5, 0.98), (2.5, 1.02)])),
        Point(3.5, 1),
    ),
}


@pytest.mark.parametrize("name", SHAPES)
def test_sharp_corners_become_blunt_inside_the_domain(name):
    domain, goal = SHAPES[name]
    blunt = blunted(domain)
    assert np.rad2deg(sharpest_angle(domain)) < 10.0 < 60.0 < np.rad2deg(sharpest_angle(blunt))
    size = np.hypot(*np.subtract(domain.bounds[2:], domain.bounds[:2]))
    assert domain.buffer(1e-12 * size).covers(blunt)
    assert domain.difference(blunt).area < 4e-4 * size**2
    assert HarmonicMap(blunt, goal, tolerance=1e-6).accuracy.error_estimate <= 1e-6


def test_only_the_surroundings_of_a_tip_change():
    domain, _ = domains.needle(5)
    blunt = blunted(domain, depth=0.05)
    tip = Point(min(domain.exterior.coords))
    assert domain.difference(blunt).difference(tip.buffer(0.051)).area < 1e-12
    assert tip.distance(blunt) == pytest.approx(0.05 * np.cos(np.deg2rad(2.5)))


def test_a_cap_stays_clear_of_the_wall_opposite():
    domain = HALL.difference(Polygon([(1, 2), (2, 1e-3), (1.05, 2)]))
    blunt = blunted(domain)
    assert blunt.is_valid
    assert len(blunt.interiors) == 0
    assert blunt.contains(Point(0.2, 1))
    assert blunt.contains(Point(3.5, 1))


def test_what_is_blunt_stays_as_it_is():
    assert blunted(HALL) is HALL


def test_a_corner_without_room_is_refused_by_name():
    touching = HALL.difference(Polygon([(2, 0), (2.3, 0.5), (2.31, 0.5)]))
    with pytest.raises(UnmappableError, match=r"corner at \(2, 0\) m") as caught:
        blunted(touching)
    assert caught.value.place == (2.0, 0.0)


@pytest.mark.parametrize("bad", [{"sharpest": 0.0}, {"sharpest": 60.0}, {"depth": -1.0}])
def test_angles_and_depths_out_of_bounds_are_refused(bad):
    with pytest.raises(FieldError, match=r"sharpest must be in \(0, 45\] degrees, depth positive"):
        blunted(HALL, **bad)
