"""Exact signed distances of all bodies to the walls of the floor and to the bodies that they must not touch.

A piece of a body is the hull of its vertices grown by a radius; distances are taken from the hulls, then the
radii off.
"""

from __future__ import annotations

from math import hypot, inf, sqrt

import numpy as np
from shapely import Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.polygons import (
    edges_of,
    meets_ring,
    signed_distance,
    squared_distance,
    squared_ring_distance,
)
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import ComponentTree, TeamArrays, moved, place_into


@compiled(borrows=True)
def team_distances(
    team: TeamArrays, walls: FloatArray, poses: FloatArray, vertices: FloatArray, discs: FloatArray,
    z: FloatArray,
) -> tuple[float, int, float, int]:  # fmt: skip
    """Return the smallest distance to the walls and its piece, then that between bodies and its pair [m].

    Depths are negative distances. Without a pair the distance between bodies is infinite.

    Args:
        team: The team.
        walls: Edges (x0, y0, x1, y1) of the floor's rings, shape (E, 4) [m].
        poses: This and the next two arguments are the room that the team gives.
        vertices: Vertices of all pieces in W, shape (V, 2) [m].
        discs: Discs (x, y, radius) in W that hold the pieces, shape (P, 3) [m].
        z: (x, y, theta, q...), shape (3 + n,) [m, rad].
    """
    place_pieces(team, z, poses, vertices, discs)
    wall, piece, between, pair = inf, 0, inf, 0
    for i in range(len(team.pieces)):
        distance = piece_to_walls(team, vertices, discs, walls, i, wall)
        if distance < wall:
            wall, piece = distance, i
    for k in range(len(team.pairs)):
        distance = pair_apart(team, vertices, discs, k, between)
        if distance < between:
            between, pair = distance, k
    return wall, piece, between, pair


@compiled(borrows=True)
def place_pieces(
    team: TeamArrays, z: FloatArray, poses: FloatArray, vertices: FloatArray, discs: FloatArray
) -> None:
    """Write where vertices and discs of all pieces are in W; arguments as in ``team_distances``."""
    place_into(team, z, poses)
    for i in range(len(team.pieces)):
        c = team.pieces[i, 0]
        x, y, cosine, sine = poses[c, 0], poses[c, 1], poses[c, 2], poses[c, 3]
        discs[i, 0], discs[i, 1] = moved(x, y, cosine, sine, team.discs[i, 0], team.discs[i, 1])
        discs[i, 2] = team.discs[i, 2]
        for k in range(team.pieces[i, 1], team.pieces[i, 2]):
            u, v = team.vertices[k, 0], team.vertices[k, 1]
            vertices[k, 0], vertices[k, 1] = moved(x, y, cosine, sine, u, v)


@compiled(borrows=True)
def piece_to_walls(
    team: TeamArrays, vertices: FloatArray, discs: FloatArray, walls: FloatArray, i: int, bound: float
) -> float:
    """Return the signed distance of piece i to the walls, or less if that is not below a bound [m].

    The other arguments are those of ``team_distances``.
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
    if not outside:
        return sqrt(squared) - team.radii[i]
    # The deepest vertex: of the piece outside the floor, or of a wall inside the piece.
    depth = 0.0
    for w in range(len(walls)):
        x, y = walls[w, 0], walls[w, 1]
        if meets_ring(vertices, first, last, x, y, x, y):
            depth = max(depth, sqrt(squared_ring_distance(vertices, first, last, x, y, x, y, inf)))
    for k in range(first, last):
        depth = max(depth, -signed_distance(walls, vertices[k, 0], vertices[k, 1]))
    return -depth - team.radii[i]


@compiled(borrows=True)
def pair_apart(team: TeamArrays, vertices: FloatArray, discs: FloatArray, k: int, bound: float) -> float:
    """Return the signed distance of pair k, or less if that is not below a bound [m]."""
    i, j = team.pairs[k, 0], team.pairs[k, 1]
    apart = hypot(discs[i, 0] - discs[j, 0], discs[i, 1] - discs[j, 1]) - discs[i, 2] - discs[j, 2]
    if apart >= bound:
        return apart
    # The distance of the two hulls; where they overlap, minus the depth of the deepest vertex.
    one, other, radii = team.pieces[i], team.pieces[j], (team.radii[i], team.radii[j])
    squared, depth, overlap = inf, 0.0, False
    before = other[2] - 1
    for corner in range(other[1], other[2]):
        x, y, u, v = vertices[corner, 0], vertices[corner, 1], vertices[before, 0], vertices[before, 1]
        before = corner
        overlap = overlap or meets_ring(vertices, one[1], one[2], u, v, x, y)
        squared = squared_ring_distance(vertices, one[1], one[2], u, v, x, y, squared)
        if meets_ring(vertices, one[1], one[2], x, y, x, y):
            depth = max(depth, sqrt(squared_ring_distance(vertices, one[1], one[2], x, y, x, y, inf)))
    for corner in range(one[1], one[2]):
        x, y = vertices[corner, 0], vertices[corner, 1]
        if meets_ring(vertices, other[1], other[2], x, y, x, y):
            overlap = True
            depth = max(depth, sqrt(squared_ring_distance(vertices, other[1], other[2], x, y, x, y, inf)))
    return (-depth if overlap else sqrt(squared)) - radii[0] - radii[1]


class TeamClearance:
    """Exact distances of the team's convex pieces to the walls and to each other.

    Args:
        workspace: The floor; its rings are the walls [m].
        tree: The team's bodies and how they hang together.

    Raises:
        GeometryError: The tree has no shape at all.
    """

    def __init__(self, workspace: Polygon, tree: ComponentTree) -> None:
        self._names = [
            body.name for component in tree.components for body in component.bodies for _ in body.shapes
        ]
        if not self._names:
            raise GeometryError("the component tree has no body with a shape, so no clearance is defined")
        self.team, self.walls = tree.arrays, np.ascontiguousarray(edges_of(workspace))
        #: The first arguments of ``team_distances`` for this team and floor.
        self.kernel_arguments = self.team, self.walls, *self.team.room()

    def wall_place(self, piece: int) -> str:
        """Return a phrase for the two sides of a piece's distance to the walls."""
        return f"{self._names[piece]} and the walls"

    def pair_place(self, pair: int) -> str:
        """Return a phrase for the two sides of a pair's distance."""
        pairs = self.team.pairs
        if not len(pairs):
            return "no two bodies"
        first, second = (self._names[piece] for piece in pairs[pair, :2])
        return f"{first} and {second}"
