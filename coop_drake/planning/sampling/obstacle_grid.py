"""A grid over a floor: each square lists the obstacle edges near it, nearest first, for compiled checks."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import sqrt
from typing import NamedTuple

import numpy as np
from shapely import MultiPolygon, Polygon

from coop_drake.compiled import compiled
from coop_drake.geometry.convex import following
from coop_drake.geometry.distances import ray_crosses, squared_distance
from coop_drake.geometry.minkowski import FreeSpace
from coop_drake.geometry.parts import polygon_rings
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.tree.team_arrays import TeamArrays

FAR = 0.2
"""Larger clearances count as this one [m], which limits how many edges the squares list."""

_MOST_SQUARES = 40_000
"""Greatest number of squares, about: it limits the time and the memory that a grid takes."""

_SQUARES_PER_REACH = 6.0
"""Squares in the distance within which edges are listed [-]: lists of neighbouring squares differ little."""

_REMEMBERED = 4
"""Grids that are remembered [-]; one over a large floor takes some megabytes."""

_OFF_THE_EDGES = np.array([0.317, 0.291])
"""Shift of the grid against the floor's corner, in squares [-]: middles of squares then hardly ever lie on
edges, where it is undefined whether they are inside."""


class ObstacleGrid(NamedTuple):
    """Edges of a floor and a grid over it, E edges, S squares, L entries in all lists.

    Attributes:
        edges: Edges (x0, y0, x1, y1) of closed rings, shape (E, 4) [m].
        corner: Lower corner of the grid, shape (2,) [m].
        side: Side of a square [m].
        rows: Number of squares along y.
        columns: Number of squares along x.
        reach: The lists hold every edge that comes this close to a point of their square [m].
        first: Where each square's list begins, squares along y first, shape (S + 1,).
        listed: Edges, nearest to the square's middle first, shape (L,).
        away: Their distances from that middle, shape (L,) [m].
        inside: Whether the middle of a square lies on the floor, shape (S,).
    """

    edges: FloatArray
    corner: FloatArray
    side: float
    rows: int
    columns: int
    reach: float
    first: IntArray
    listed: IntArray
    away: FloatArray
    inside: IntArray


def lay_grid(rings: Sequence[FloatArray], reach: float) -> ObstacleGrid:
    """Lay a grid over a floor.

    Args:
        rings: Closed rings of the floor, holes too, in any direction, shape (n, 2) each [m].
        reach: Distance up to which edges near a point are listed [m].

    Returns:
        The grid; of a floor without rings a grid without squares, on which no point is inside.
    """
    if not rings:
        none = np.empty(0, np.int64)
        return ObstacleGrid(
            np.empty((0, 4)), np.zeros(2), 1.0, 0, 0, reach, np.zeros(1, np.int64), none, np.empty(0), none
        )
    edges = np.concatenate([np.hstack((ring, following(ring))) for ring in rings])
    ends = edges.reshape(-1, 2)
    corner, size = ends.min(axis=0), np.ptp(ends, axis=0)
    side = max(reach / _SQUARES_PER_REACH, sqrt(float(size[0] * size[1]) / _MOST_SQUARES))
    corner = corner - side * _OFF_THE_EDGES
    columns, rows = (int(count) + 2 for count in size / side)
    radius = reach + 0.5 * sqrt(2.0) * side
    first, listed, away = _lists(edges, corner, side, rows, columns, radius)
    inside = centres_inside(edges, corner, side, rows, columns)
    return ObstacleGrid(edges, corner, side, rows, columns, reach, first, listed, away, inside)


@compiled
def square_at(grid: ObstacleGrid, x: float, y: float) -> tuple[int, int]:
    """Column and row of the square that holds a point, -1 for both if none does."""
    column, row = np.floor((x - grid.corner[0]) / grid.side), np.floor((y - grid.corner[1]) / grid.side)
    if column < 0 or row < 0 or column >= grid.columns or row >= grid.rows:
        return -1, -1
    return int(column), int(row)


@compiled
def _lists(
    edges: FloatArray, corner: FloatArray, side: float, rows: int, columns: int, radius: float
) -> tuple[IntArray, IntArray, FloatArray]:
    """For each square the edges within a radius of its middle, nearest first."""
    first = np.zeros(rows * columns + 1, np.int64)
    fill, listed, away = np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    for writing in range(2):
        for e in range(len(edges)):
            x0, y0, x1, y1 = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
            west = max(0, int((min(x0, x1) - radius - corner[0]) / side))
            east = min(columns, int((max(x0, x1) + radius - corner[0]) / side) + 1)
            south = max(0, int((min(y0, y1) - radius - corner[1]) / side))
            north = min(rows, int((max(y0, y1) + radius - corner[1]) / side) + 1)
            for column in range(west, east):
                x = corner[0] + (column + 0.5) * side
                for row in range(south, north):
                    y = corner[1] + (row + 0.5) * side
                    square = column * rows + row
                    gap = squared_distance(x, y, x0, y0, x1, y1)
                    if gap > radius * radius:
                        continue
                    if writing == 0:
                        first[square + 1] += 1
                        continue
                    gap = sqrt(gap)
                    k = fill[square]
                    while k > first[square] and away[k - 1] > gap:
                        away[k], listed[k] = away[k - 1], listed[k - 1]
                        k -= 1
                    away[k], listed[k] = gap, e
                    fill[square] += 1
        if writing == 0:
            fill = np.empty(rows * columns, np.int64)
            for square in range(rows * columns):
                fill[square] = first[square]
                first[square + 1] += first[square]
            listed, away = np.empty(first[-1], np.int64), np.empty(first[-1])
    return first, listed, away


@compiled
def centres_inside(edges: FloatArray, corner: FloatArray, side: float, rows: int, columns: int) -> IntArray:
    """Whether the middle of each square lies on the floor, by the even-odd rule along its row.

    Args:
        edges: Edges (x0, y0, x1, y1) of closed rings, shape (E, 4) [m].
        corner: Lower corner of the squares, shape (2,) [m].
        side: Side of a square [m].
        rows: Number of squares along y.
        columns: Number of squares along x.

    Returns:
        1 inside, 0 outside, squares along y first, shape (rows * columns,).
    """
    inside = np.zeros(rows * columns, np.int64)
    for e in range(len(edges)):
        x0, y0, x1, y1 = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        south = max(0, int((min(y0, y1) - corner[1]) / side) - 1)
        north = min(rows, int((max(y0, y1) - corner[1]) / side) + 1)
        for row in range(south, north):
            y = corner[1] + (row + 0.5) * side
            if (y0 > y) == (y1 > y):
                continue
            # The edge is crossed by the rays from the middles of all columns before this one.
            crossing = x0 + (y - y0) / (y1 - y0) * (x1 - x0)
            before = min(max(int((crossing - corner[0]) / side + 0.5), 0), columns)
            while before > 0 and not ray_crosses(corner[0] + (before - 0.5) * side, y, x0, y0, x1, y1):
                before -= 1
            while before < columns and ray_crosses(corner[0] + (before + 0.5) * side, y, x0, y0, x1, y1):
                before += 1
            if before > 0:
                inside[(before - 1) * rows + row] ^= 1
    for square in range(rows * (columns - 1) - 1, -1, -1):
        inside[square] ^= inside[square + rows]
    return inside


def grid_for_team(workspace: Polygon | MultiPolygon, team: TeamArrays) -> ObstacleGrid:
    """Lay a grid over a floor, fine and wide enough for a team and for distances up to ``FAR``."""
    return _grid(workspace, float(team.discs[:, 2].max(initial=0.0)) + FAR)


@lru_cache(maxsize=_REMEMBERED)
def _grid(workspace: Polygon | MultiPolygon, reach: float) -> ObstacleGrid:
    """A grid over a floor; the last few are remembered, for a search uses them again and again."""
    return lay_grid(polygon_rings(workspace), reach)


@lru_cache(maxsize=_REMEMBERED)
def grid_inside(workspace: Polygon | MultiPolygon, reach: float) -> ObstacleGrid:
    """Lay a grid over a floor shrunk by ``SAFE_SIDE``: all inside it is on the floor, despite rounding.

    The last few are remembered.
    """
    return lay_grid(FreeSpace.under(workspace).rings, reach + FAR)
