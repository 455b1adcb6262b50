"""The grid of walls: every square lists all edges near it, nearest first, and knows whether it is inside."""

import numpy as np
import pytest
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon, box

from coop_drake.geometry.minkowski import polygon_rings
from coop_drake.planning.boxes.boxes import nearby
from coop_drake.planning.sampling.obstacle_grid import Walls, square_at, walls_near
from tests.support.cases import warehouse
from tests.support.trees import room

FLOORS = {
    "room": room(),
    "warehouse": warehouse(),
    "two": MultiPolygon([box(0, 0, 2, 1), Polygon(box(3, 0, 6, 3).exterior, [box(4, 1, 5, 2).exterior])]),
    "far away": shapely.transform(room(), lambda points: points + np.array([1e4, -2e4])),
}


def middle(walls: Walls, square: int) -> np.ndarray:
    """Middle of a square."""
    column, row = divmod(square, walls.rows)
    return walls.corner + (np.array([column, row]) + 0.5) * walls.side


@pytest.mark.parametrize("reach", [0.05, 0.7])
@pytest.mark.parametrize("name", FLOORS)
def test_a_square_lists_every_edge_that_comes_near_it(name: str, reach: float) -> None:
    walls = walls_near(polygon_rings(FLOORS[name]), reach)
    edges = shapely.linestrings(walls.edges.reshape(-1, 2, 2))
    squares = np.random.default_rng(3).permutation(walls.rows * walls.columns)[:150]
    for square in squares.tolist():
        here = middle(walls, square)
        half = 0.5 * walls.side
        area = box(*(here - half), *(here + half))
        listed = walls.listed[walls.first[square] : walls.first[square + 1]]
        away = walls.away[walls.first[square] : walls.first[square + 1]]
        assert set(np.flatnonzero(shapely.distance(edges, area) < reach - 1e-9)) <= set(listed.tolist())
        assert (np.diff(away) >= 0.0).all()
        assert away == pytest.approx(shapely.distance(edges[listed], Point(here)), abs=1e-7)
        assert len(set(listed.tolist())) == len(listed)


@pytest.mark.parametrize("name", FLOORS)
def test_middles_lie_inside_where_the_floor_is(name: str) -> None:
    walls = walls_near(polygon_rings(FLOORS[name]), 0.5)
    middles = np.array([middle(walls, square) for square in range(walls.rows * walls.columns)])
    assert (walls.inside == shapely.contains_xy(FLOORS[name], middles)).all()
    assert walls.inside.any()


def test_points_find_their_square_or_none() -> None:
    walls = walls_near(polygon_rings(room()), 0.4)
    for square in range(0, walls.rows * walls.columns, 7):
        assert square_at(walls, *middle(walls, square)) == square
    end = walls.corner + walls.side * np.array([walls.columns, walls.rows])
    for x, y in [walls.corner - 1e-6, end + 1e-6, (walls.corner[0] - 5.0, end[1] - 0.1)]:
        assert square_at(walls, x, y) == -1


def test_a_floor_without_rings_has_no_squares() -> None:
    walls = walls_near([], 0.5)
    assert len(walls.edges) == 0
    assert square_at(walls, 0.0, 0.0) == -1


@pytest.mark.parametrize("reach", [0.2, 1.5])
def test_the_floor_near_a_way_is_all_that_a_team_can_touch(reach: float) -> None:
    floor = warehouse()
    way = np.array([[0.9, 2.0], [0.9, 3.4], [1.1, 5.0]])
    near = nearby(floor, way, reach)
    touched = LineString(way).buffer(reach)
    assert near.intersection(touched).symmetric_difference(floor.intersection(touched)).area < 1e-9
    assert near.difference(floor).area < 1e-9
    assert near.area < floor.area


def test_far_from_the_floor_there_is_nothing_near() -> None:
    assert nearby(warehouse(), np.array([[50.0, 50.0]]), 1.0).is_empty
