"""Compiled checks of configurations and segments, and clearances of convex pieces, on a grid over the floor.

They guide the search; proofs use them on over-sweeps only, in ``boxes``.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import sqrt
from typing import NamedTuple

import numpy as np
from shapely import MultiPolygon, Polygon

from coop_drake.geometry.minkowski import FreeSpace
from coop_drake.geometry.polygons import (
    meets_ring,
    polygon_rings,
    ray_crosses,
    segments_cross,
    squared_distance,
    squared_ring_distance,
)
from coop_drake.geometry.sweeps import following
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import TeamArrays, place_into

# Samples added to a path, so that neighbours are near to each other.


def densified(path: FloatArray, scale: FloatArray, step: float) -> FloatArray:
    """A path with samples added, so that neighbours are at most a step apart in every scaled axis.

    Args:
        path: Configurations, shape (k, d).
        scale: How far a unit of each axis moves the team, shape (d,).
        step: The distance [m].

    Returns:
        Configurations, shape (m, d), those of the path among them.
    """
    if len(path) < 2:
        return path.copy()
    moved = np.abs(np.diff(path, axis=0) * scale).max(axis=1)
    parts = np.maximum(1, np.ceil(moved / step)).astype(int)
    rows = np.repeat(np.arange(len(parts)), parts)
    fraction = (np.arange(len(rows)) - np.repeat(np.cumsum(parts) - parts, parts) + 1.0) / parts[rows]
    dense: FloatArray = path[rows] + fraction[:, None] * (path[rows + 1] - path[rows])
    return np.concatenate((path[:1], dense))


# A grid over a floor: each square lists the obstacle edges near it, nearest first, for compiled checks.

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


# Compiled checks of single configurations and straight segments, and the clearance of a convex piece.
#
# They guide the search; proofs use them on over-sweeps only, in ``boxes``.


@compiled(inlined=True, borrows=True)
def ring_clearance(
    grid: ObstacleGrid,
    vertices: FloatArray,
    first: int,
    last: int,
    radius: float,
    disc: FloatArray,
    px: float,
    py: float,
    c: float,
    s: float,
    most: float,
) -> float:
    """Distance of a convex piece from the obstacles, at most ``most``; -1 where it meets one or is outside.

    Args:
        grid: The floor; of a piece that is wider than the grid's reach every edge is looked at.
        vertices: Vertices in the piece's frame, shape (V, 2) [m].
        first: First vertex of the piece.
        last: The vertex after its last.
        radius: Growth of the piece [m].
        disc: A disc (x, y, radius) in the piece's frame that holds the piece, shape (3,) [m].
        px: First coordinate of the frame's origin in W [m].
        py: Second coordinate [m].
        c: Cosine of the frame's angle.
        s: Sine of the frame's angle.
        most: Distances above this one do not matter [m].
    """
    x, y, reach = px + c * disc[0] - s * disc[1], py + s * disc[0] + c * disc[1], disc[2]
    column, row = np.floor((x - grid.corner[0]) / grid.side), np.floor((y - grid.corner[1]) / grid.side)
    if column < 0 or row < 0 or column >= grid.columns or row >= grid.rows:
        return -1.0
    square = int(column) * grid.rows + int(row)
    mx, my = grid.corner[0] + (column + 0.5) * grid.side, grid.corner[1] + (row + 0.5) * grid.side
    off = sqrt((x - mx) * (x - mx) + (y - my) * (y - my))
    near = reach <= grid.reach
    inside = grid.inside[square] == 1
    best = min(most, grid.reach - reach) if near else most
    for k in range(grid.first[square] if near else 0, grid.first[square + 1] if near else len(grid.edges)):
        if near and grid.away[k] > off + reach + best:
            break
        e = grid.listed[k] if near else k
        x0, y0, x1, y1 = grid.edges[e, 0], grid.edges[e, 1], grid.edges[e, 2], grid.edges[e, 3]
        if (not near or grid.away[k] <= off) and segments_cross(mx, my, x, y, x0, y0, x1, y1):
            inside = not inside
        if squared_distance(x, y, x0, y0, x1, y1) > (reach + best) ** 2:
            continue
        ax, ay = c * (x0 - px) + s * (y0 - py), c * (y0 - py) - s * (x0 - px)
        bx, by = c * (x1 - px) + s * (y1 - py), c * (y1 - py) - s * (x1 - px)
        if meets_ring(vertices, first, last, ax, ay, bx, by):
            return -1.0
        if best > 0.0 or radius > 0.0:
            gap = sqrt(squared_ring_distance(vertices, first, last, ax, ay, bx, by, np.inf)) - radius
            if gap <= 0.0:
                return -1.0
            best = min(best, gap)
    return best if inside else -1.0


@compiled(borrows=True)
def _apart(team: TeamArrays, poses: FloatArray, a: int, b: int, gap: float) -> bool:
    """Whether the line of an edge of b, or b's outline if a is a disc, shows that a keeps the gap from b."""
    A, B = team.pieces[a, 0], team.pieces[b, 0]
    bc, bs = poses[B, 2], poses[B, 3]
    dx, dy = poses[A, 0] - poses[B, 0], poses[A, 1] - poses[B, 1]
    ox, oy = bc * dx + bs * dy, bc * dy - bs * dx
    c, s = bc * poses[A, 2] + bs * poses[A, 3], bc * poses[A, 3] - bs * poses[A, 2]
    need = team.radii[a] + team.radii[b] + gap
    vertices = team.vertices
    m, n, i, j = team.pieces[a, 1], team.pieces[a, 2], team.pieces[b, 1], team.pieces[b, 2]
    outside = j - i == 1
    before = j - 1
    for k in range(i, j if j - i > 1 else i):
        x, y = vertices[before, 0], vertices[before, 1]
        nx, ny = vertices[k, 1] - y, x - vertices[k, 0]
        length = sqrt(nx * nx + ny * ny)
        ux, uy = c * nx + s * ny, c * ny - s * nx
        nearest = np.inf
        for v in range(m, n):
            nearest = min(nearest, ux * vertices[v, 0] + uy * vertices[v, 1])
        nearest += nx * (ox - x) + ny * (oy - y)
        if nearest > need * length:
            return True
        outside = outside or nearest > 0.0
        before = k
    if n - m > 1 or not outside:
        return False
    x, y = vertices[m, 0], vertices[m, 1]
    px, py = ox + c * x - s * y, oy + s * x + c * y
    apart: bool = squared_ring_distance(vertices, i, j, px, py, px, py, np.inf) > need * need
    return apart


ALL = -1
"""In place of a component: all of them."""


@compiled(borrows=True)
def bodies_apart(team: TeamArrays, poses: FloatArray, gap: float, component: int) -> bool:
    """Whether no two bodies come closer than the gap.

    Args:
        team: The team.
        poses: Poses of all components, or of the component and those before it, see ``place``, shape (C, 5).
        gap: The distance [m].
        component: Only pairs of its bodies with those of the components before it are looked at, or ``ALL``.
    """
    discs = team.discs
    for k in range(len(team.pairs)):
        a, b = team.pairs[k, 0], team.pairs[k, 1]
        A, B = team.pieces[a, 0], team.pieces[b, 0]
        if component >= 0 and max(A, B) != component:
            continue
        # In most pairs the discs about the pieces keep the gap already.
        P, Q = poses[A], poses[B]
        ax, ay, bx, by = discs[a, 0], discs[a, 1], discs[b, 0], discs[b, 1]
        dx = P[0] + P[2] * ax - P[3] * ay - Q[0] - Q[2] * bx + Q[3] * by
        dy = P[1] + P[3] * ax + P[2] * ay - Q[1] - Q[3] * bx - Q[2] * by
        reach = discs[a, 2] + discs[b, 2] + gap
        if dx * dx + dy * dy > reach * reach:
            continue
        if not _apart(team, poses, a, b, gap) and not _apart(team, poses, b, a, gap):
            return False
    return True


@compiled(borrows=True)
def team_clearance(
    team: TeamArrays, grid: ObstacleGrid, poses: FloatArray, most: float, component: int
) -> float:
    """Distance of the team from the obstacles, at most ``most``; -1 where it meets one or a piece is outside.

    Args:
        team: The team.
        grid: The floor, whose reach is that of the widest piece and ``most`` more.
        poses: Poses of all components, see ``place``, shape (C, 5).
        most: Distances above this one do not matter [m].
        component: Whose pieces are looked at, or ``ALL``.
    """
    best = most
    for piece in range(len(team.pieces) - 1, -1, -1):
        if component >= 0 and team.pieces[piece, 0] != component:
            continue
        X, first, last = poses[team.pieces[piece, 0]], team.pieces[piece, 1], team.pieces[piece, 2]
        best = ring_clearance(
            grid, team.vertices, first, last, team.radii[piece], team.discs[piece],
            X[0], X[1], X[2], X[3], best,
        )  # fmt: skip
        if best < 0.0:
            return -1.0
    return best


def is_free(team: TeamArrays, grid: ObstacleGrid, z: FloatArray, gap: float) -> bool:
    """Whether a configuration touches no wall and no two bodies come closer than the gap.

    Args:
        team: The team.
        grid: The floor.
        z: (x, y, theta, q...), shape (3 + n,).
        gap: Distance that pairs of bodies must keep [m].
    """
    free: bool = is_free_placed(team, grid, z, gap, np.empty((len(team.links), 5)))
    return free


@compiled(borrows=True)
def is_free_placed(
    team: TeamArrays, grid: ObstacleGrid, z: FloatArray, gap: float, poses: FloatArray
) -> bool:
    """As ``is_free``, with room for the poses of all components, shape (C, 5)."""
    place_into(team, z, poses)
    return team_clearance(team, grid, poses, 0.0, ALL) >= 0.0 and bodies_apart(team, poses, gap, ALL)


@compiled(borrows=True)
def segment_is_free(
    team: TeamArrays,
    grid: ObstacleGrid,
    first: FloatArray,
    last: FloatArray,
    gap: float,
    scale: FloatArray,
    step: float,
    z: FloatArray,
    poses: FloatArray,
) -> float:
    """Fraction of a straight segment that is free, up to the last configuration checked before a collision.

    Args:
        team: The team.
        grid: The floor.
        first: Free configuration to leave from, shape (d,).
        last: Configuration to reach, shape (d,).
        gap: Distance that pairs of bodies must keep [m].
        scale: How far a unit of each axis moves the team, shape (d,).
        step: Distance between checks [m].
        z: Room for a configuration, shape (d,).
        poses: Room for the poses of all components, shape (C, 5).
    """
    length = 0.0
    for k in range(len(first)):
        length = max(length, abs(last[k] - first[k]) * scale[k])
    count = max(1, int(np.ceil(length / step)))
    for i in range(1, count + 1):
        for k in range(len(z)):
            z[k] = first[k] + (last[k] - first[k]) * (i / count)
        if not is_free_placed(team, grid, z, gap, poses):
            return (i - 1) / count
    return 1.0
