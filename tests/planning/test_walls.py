"""The grid of grid: every square lists all edges near it, nearest first, and knows whether it is inside."""

import numpy as np
import pytest
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon, box

from coop_drake.geometry.polygons import polygon_rings
from coop_drake.planning.questions import nearby
from coop_drake.planning.sampling.collision import ObstacleGrid, lay_grid, square_at
from tests.support.cases import warehouse
from tests.support.trees import room

FLOORS = {
    "room": room(),
    "warehouse": warehouse(),
    "two": MultiPolygon([box(0, 0, 2, 1), Polygon(box(3, 0, 6, 3).exterior, [box(4, 1, 5, 2).exterior])]),
    "far away": shapely.transform(room(), lambda points: points + np.array([1e4, -2e4])),
}


def middle(grid: ObstacleGrid, square: int) -> np.ndarray:
    """Middle of a square."""
    column, row = divmod(square, grid.rows)
    return grid.corner + (np.array([column, row]) + 0.5) * grid.side


@pytest.mark.parametrize("reach", [0.05, 0.7])
@pytest.mark.parametrize("name", FLOORS)
def test_a_square_lists_every_edge_that_comes_near_it(name: str, reach: float) -> None:
    grid = lay_grid(polygon_rings(FLOORS[name]), reach)
    edges = shapely.linestrings(grid.edges.reshape(-1, 2, 2))
    squares = np.random.default_rng(3).permutation(grid.rows * grid.columns)[:150]
    for square in squares.tolist():
        here = middle(grid, square)
        half = 0.5 * grid.side
        area = box(*(here - half), *(here + half))
        listed = grid.listed[grid.first[square] : grid.first[square + 1]]
        away = grid.away[grid.first[square] : grid.first[square + 1]]
        assert set(np.flatnonzero(shapely.distance(edges, area) < reach - 1e-9)) <= set(listed.tolist())
        assert (np.diff(away) >= 0.0).all()
        assert away == pytest.approx(shapely.distance(edges[listed], Point(here)), abs=1e-7)
        assert len(set(listed.tolist())) == len(listed)


@pytest.mark.parametrize("name", FLOORS)
def test_middles_lie_inside_where_the_floor_is(name: str) -> None:
    grid = lay_grid(polygon_rings(FLOORS[name]), 0.5)
    middles = np.array([middle(grid, square) for square in range(grid.rows * grid.columns)])
    assert (grid.inside == shapely.contains_xy(FLOORS[name], middles)).all()
    assert grid.inside.any()


def test_points_find_their_square_or_none() -> None:
    grid = lay_grid(polygon_rings(room()), 0.4)
    for square in range(0, grid.rows * grid.columns, 7):
        assert square_at(grid, *middle(grid, square)) == divmod(square, grid.rows)
    end = grid.corner + grid.side * np.array([grid.columns, grid.rows])
    for x, y in [grid.corner - 1e-6, end + 1e-6, (grid.corner[0] - 5.0, end[1] - 0.1)]:
        assert square_at(grid, x, y) == (-1, -1)


def test_a_floor_without_rings_has_no_squares() -> None:
    grid = lay_grid([], 0.5)
    assert len(grid.edges) == 0
    assert square_at(grid, 0.0, 0.0) == (-1, -1)


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
