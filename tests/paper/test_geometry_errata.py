"""E4, E6 and E9: which configurations are free, and what over- and under-approximations are."""

import numpy as np
from shapely import Point, Polygon, box
from shapely.affinity import rotate, translate

from coop_drake.geometry.minkowski import FreeSpace, to_polygon
from coop_drake.geometry.sweeps import over_revolute, under_revolute

WORKSPACE = box(0.0, 0.0, 4.0, 2.0)
BAR = np.array([[-0.5, -0.05], [0.5, -0.05], [0.5, 0.05], [-0.5, 0.05]])
MIDDLE, HALF = np.radians(30.0), np.radians(30.0)
FOOTPRINTS = [rotate(Polygon(BAR), angle, origin=(0.0, 0.0)) for angle in np.linspace(0.0, 60.0, 13)]
OVER, UNDER = over_revolute(BAR, MIDDLE, HALF), under_revolute(BAR, MIDDLE, HALF)


def hits_the_wall(shape):
    """Whether a shape reaches into the complement of the workspace."""
    return not shape.difference(WORKSPACE).is_empty


def safe_positions(footprint):
    """Positions from which a footprint stays in the workspace, as cells are computed."""
    (part,) = FreeSpace.under(WORKSPACE).minus(footprint).decompose()
    return to_polygon(part)


def test_e4_the_workspace_is_where_the_robots_may_be():
    """(4) calls z free if W and R(z) do not meet: the complement of W is meant."""
    bar, free = Polygon(BAR), safe_positions(BAR)
    places = (2.0, 1.0), (9.0, 9.0), (2.0, 0.01)
    in_the_middle, in_the_wall, through_the_wall = (translate(bar, *place) for place in places)
    printed = [WORKSPACE.intersection(body).is_empty for body in (in_the_middle, in_the_wall)]
    corrected = [free.contains(Point(place)) for place in places]
    assert printed == [False, True]
    assert corrected == [True, False, False]
    assert hits_the_wall(through_the_wall)


def test_e6_the_second_line_defines_the_under_approximation():
    """(6) overlines the intersection too; an over-approximation would have to hold every footprint."""
    over, under = Polygon(OVER), Polygon(UNDER)
    assert all(over.covers(footprint) for footprint in FOOTPRINTS)
    assert all(footprint.covers(under) for footprint in FOOTPRINTS)
    assert not any(under.covers(footprint) for footprint in FOOTPRINTS)
    assert 0.0 < under.area < FOOTPRINTS[0].area < over.area


def test_e9_only_positions_free_for_the_union_are_free_for_every_angle():
    """(9) with the intersection in the place of R's over-approximation calls a colliding position safe."""
    near_the_wall = (2.0, 0.3)
    assert any(hits_the_wall(translate(footprint, *near_the_wall)) for footprint in FOOTPRINTS)
    assert safe_positions(UNDER).contains(Point(near_the_wall))
    corrected = safe_positions(OVER)
    assert not corrected.contains(Point(near_the_wall))
    for corner in corrected.exterior.coords:
        assert not any(hits_the_wall(translate(footprint, *corner).buffer(-1e-6)) for footprint in FOOTPRINTS)
