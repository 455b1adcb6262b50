"""Fields whose direction drowns in the map's error are refused; all others point where they should."""

import numpy as np
import pytest
import shapely
from shapely import Point, box

from coop_drake.errors import FieldError
from coop_drake.fields import HarmonicMap, VelocityField
from coop_drake.fields.certainty import direction_error
from tests.support import domains

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
