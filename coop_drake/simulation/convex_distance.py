"""Exact signed distances of the team's convex pieces to the walls and to each other, compiled.

A piece is the hull of its vertices grown by a radius; distances are taken from the hulls, then the radii off.
"""

from __future__ import annotations

from math import hypot, inf, sqrt

from coop_drake.geometry.boundary import signed_distance
from coop_drake.geometry.distances import meets_ring, ring_holds, squared_distance, squared_ring_distance
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.tree.team_arrays import TeamArrays


@compiled(borrows=True)
def nearest_to_walls(
    team: TeamArrays, vertices: FloatArray, discs: FloatArray, walls: FloatArray
) -> tuple[float, int]:
    """Smallest signed distance of a piece to the walls [m], minus its depth beyond them, and which piece.

    Args:
        team: The team.
        vertices: Vertices of all pieces in W, shape (V, 2) [m].
        discs: Discs (x, y, radius) in W that hold the pieces, shape (P, 3) [m].
        walls: Edges (x0, y0, x1, y1) of the floor's rings, shape (E, 4) [m].
    """
    nearest, which = inf, 0
    for i in range(len(team.pieces)):
        distance = piece_to_walls(team, vertices, discs, walls, i, nearest)
        if distance < nearest:
            nearest, which = distance, i
    return nearest, which


@compiled(borrows=True)
def piece_to_walls(
    team: TeamArrays, vertices: FloatArray, discs: FloatArray, walls: FloatArray, i: int, bound: float
) -> float:
    """Return the signed distance of piece i to the walls, or less if that is not below a bound [m].

    The other arguments are those of ``nearest_to_walls``.
    """
    x, y, reach = discs[i, 0], discs[i, 1], discs[i, 2]
    first, last = team.pieces[i, 1], team.pieces[i, 2]
    middle = signed_distance(walls, x, y)
    if middle - reach >= bound:
        return middle - reach
    # A piece that meets no wall is on the same side of all walls as the middle of its disc.
    squared, outside = inf, middle < 0.0
    for w in range(len(walls)):
        x0, y0, x1, y1 = walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]
        if squared_distance(x, y, x0, y0, x1, y1) <= (reach + sqrt(squared)) ** 2:
            outside = outside or meets_ring(vertices, first, last, x0, y0, x1, y1)
            squared = squared_ring_distance(vertices, first, last, x0, y0, x1, y1, squared)
    distance = -_depth_beyond(vertices, first, last, walls) if outside else sqrt(squared)
    return distance - team.radii[i]


@compiled(borrows=True)
def _depth_beyond(vertices: FloatArray, first: int, last: int, walls: FloatArray) -> float:
    """Depth of the deepest vertex: of the piece outside the floor, or of a wall inside the piece [m]."""
    depth = 0.0
    for w in range(len(walls)):
        x, y = walls[w, 0], walls[w, 1]
        if ring_holds(vertices, first, last, x, y):
            depth = max(depth, sqrt(squared_ring_distance(vertices, first, last, x, y, x, y, inf)))
    for k in range(first, last):
        depth = max(depth, -signed_distance(walls, vertices[k, 0], vertices[k, 1]))
    return depth


@compiled(borrows=True)
def nearest_pair(team: TeamArrays, vertices: FloatArray, discs: FloatArray) -> tuple[float, int]:
    """Smallest signed distance of a pair of pieces that must not touch [m], and which pair it is.

    The distance is infinite if there is no pair. Arguments as in ``nearest_to_walls``.
    """
    nearest, which = inf, 0
    for k in range(len(team.pairs)):
        distance = pair_apart(team, vertices, discs, k, nearest)
        if distance < nearest:
            nearest, which = distance, k
    return nearest, which


@compiled(borrows=True)
def pair_apart(team: TeamArrays, vertices: FloatArray, discs: FloatArray, k: int, bound: float) -> float:
    """Return the signed distance of pair k, or less if that is not below a bound [m]."""
    i, j = team.pairs[k, 0], team.pairs[k, 1]
    apart = hypot(discs[i, 0] - discs[j, 0], discs[i, 1] - discs[j, 1]) - discs[i, 2] - discs[j, 2]
    if apart >= bound:
        return apart
    return _between(vertices, team.pieces[i], team.pieces[j]) - team.radii[i] - team.radii[j]


@compiled(borrows=True)
def _between(vertices: FloatArray, one: IntArray, other: IntArray) -> float:
    """Signed distance [m] of two hulls, rows of ``TeamArrays.pieces``; minus the deepest vertex's depth."""
    squared, depth, overlap = inf, 0.0, False
    before = other[2] - 1
    for k in range(other[1], other[2]):
        x, y, u, v = vertices[k, 0], vertices[k, 1], vertices[before, 0], vertices[before, 1]
        before = k
        overlap = overlap or meets_ring(vertices, one[1], one[2], u, v, x, y)
        squared = squared_ring_distance(vertices, one[1], one[2], u, v, x, y, squared)
        if ring_holds(vertices, one[1], one[2], x, y):
            depth = max(depth, sqrt(squared_ring_distance(vertices, one[1], one[2], x, y, x, y, inf)))
    for k in range(one[1], one[2]):
        x, y = vertices[k, 0], vertices[k, 1]
        if ring_holds(vertices, other[1], other[2], x, y):
            overlap = True
            depth = max(depth, sqrt(squared_ring_distance(vertices, other[1], other[2], x, y, x, y, inf)))
    return -depth if overlap else sqrt(squared)
