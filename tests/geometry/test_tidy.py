"""Tidy cells: inside the safe region, without holes, fit for a map, with the passage kept."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from shapely import Point, Polygon, box

from coop_drake.errors import GeometryError
from coop_drake.geometry import BoundaryDistance, PassageFinder, sharpest_angle, tidy_cell
from tests.support.channels import untidy_cell
from tests.support.shapes import floors_with_ends

ENDS = [np.array([0.5, 0.4]), np.array([3.9, 0.4])]


def edge_lengths(polygon):
    return np.linalg.norm(np.diff(shapely.get_coordinates(polygon.exterior), axis=0), axis=1)


def test_cusps_slivers_idle_vertices_and_pillars_go_and_the_clearance_stays():
    safe = untidy_cell()
    tidied = tidy_cell(safe, ENDS)
    assert not tidied.interiors
    assert len(edge_lengths(tidied)) < 25
    assert edge_lengths(tidied).min() > 0.005
    assert np.degrees(sharpest_angle(safe)) < 5.0
    assert np.degrees(sharpest_angle(tidied)) > 45.0
    clearance = PassageFinder(safe).find(*ENDS).clearance
    assert PassageFinder(tidied).find(*ENDS).clearance >= 0.8 * clearance


@given(floors_with_ends())
@settings(max_examples=60)
def test_a_tidy_cell_is_inside_whole_and_joins_the_ends(floor_with_ends):
    safe, ends = floor_with_ends
    tidied = tidy_cell(safe, ends)
    assert safe.covers(tidied)
    assert tidied.is_valid
    assert not tidied.interiors
    for end in ends:
        assert BoundaryDistance(tidied)(end) > 0.0
    assert PassageFinder(tidied).find(*ends).clearance >= 0.79 * PassageFinder(safe).find(*ends).clearance


def test_a_clean_convex_room_is_kept_but_for_the_guard():
    tidied = tidy_cell(box(0, 0, 4, 3), [np.array([1.0, 1.0]), np.array([3.0, 2.0])])
    assert tidied.area == pytest.approx(12.0, rel=1e-5)
    assert len(edge_lengths(tidied)) == 4


def test_a_region_whose_grown_boundary_crosses_itself_is_tidied():
    # Shrunk and grown again with mitred corners, it gets a boundary that GEOS does not intersect.
    corners = [(0.46759, 0.06659), (0.41756, 0.0204), (0.0825, 0.38319), (0.05462, 0.46106)]
    safe = Polygon([*corners, (0.05344, 0.46232), (0.05394, 0.4628), (0.01733, 0.55409)])
    place = 0.28, 0.218
    cell = tidy_cell(safe, [place, place])
    assert safe.contains(cell)
    assert BoundaryDistance(cell)(place) > 0.8 * BoundaryDistance(safe)(place)


def test_a_point_outside_the_safe_region_is_refused():
    with pytest.raises(GeometryError, match="holds no path"):
        tidy_cell(box(0, 0, 1, 1), [np.array([2.0, 2.0])])


def test_points_in_different_rooms_are_refused():
    rooms = box(0, 0, 2, 1).difference(box(0.9, -1, 1.1, 2).difference(Point(1, 0.5).buffer(1e-7)))
    with pytest.raises(GeometryError):
        tidy_cell(max(rooms.geoms, key=lambda part: part.area), [np.array([0.5, 0.5]), np.array([1.5, 0.5])])
