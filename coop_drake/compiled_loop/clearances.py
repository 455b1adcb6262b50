"""Smallest clearances of a run of the compiled loop, each measured only where it can be the smallest so far.

No point of a body moves further than the position does, plus what every angle and joint moves it at most. A
distance therefore stays above what it was when it was measured last, less the way since then.
"""

from __future__ import annotations

from math import hypot, inf
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.simulation.convex_distance import pair_apart, piece_to_walls
from coop_drake.simulation.step_kernels import place_pieces
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays

ROUNDING = 1e-9
"""More than what rounding errors change of a distance and of the way of a run [m]."""


class Clearances(NamedTuple):
    """What is remembered: P convex pieces, V vertices, K pairs of pieces that must not touch.

    Attributes:
        z: The configuration last looked at, NaN before the first one, shape (3 + n,) [m, rad].
        way: How far any point may have moved since the start, and how far two bodies may have moved
            relative to each other: the motion of the object does not count there, shape (2,) [m].
        walls: Distance of every piece to the walls when it was measured last, and the way until then; NaN
            before, shape (P, 2) [m].
        pairs: Distance of every pair, and its way until then, shape (K, 2) [m].
        vertices: Room for the vertices in W, shape (V, 2) [m].
        discs: Room for the discs in W, shape (P, 3) [m].
    """

    z: FloatArray
    way: FloatArray
    walls: FloatArray
    pairs: FloatArray
    vertices: FloatArray
    discs: FloatArray


@compiled
def clearance_room(size: int, team: TeamArrays) -> Clearances:
    """Return room for a run that has not begun, with 3 + n coordinates."""
    z, walls, pairs = np.empty(size), np.empty((len(team.pieces), 2)), np.empty((len(team.pairs), 2))
    for i in range(size):
        z[i] = np.nan
    for i in range(len(walls)):
        walls[i, 0] = np.nan
    for i in range(len(pairs)):
        pairs[i, 0] = np.nan
    return Clearances(z, np.zeros(2), walls, pairs, np.empty(team.vertices.shape), np.empty(team.discs.shape))


@compiled(borrows=True)
def travel(z: FloatArray, reach: FloatArray, last: Clearances) -> None:
    """Add the way to a configuration, shape (3 + n,) [m, rad]; ``reach`` is that of a ``LoopPlant``."""
    between = 0.0
    for i in range(1, reach.size):
        between += reach[i] * abs(z[2 + i] - last.z[2 + i])
    moved = hypot(z[0] - last.z[0], z[1] - last.z[1]) + reach[0] * abs(z[2] - last.z[2]) + between
    if moved >= 0.0:  # Not NaN: there was one before.
        last.way[0] += moved
        last.way[1] += 2.0 * between
    for i in range(z.size):
        last.z[i] = z[i]


@compiled(borrows=True)
def smallest_to_walls(
    z: FloatArray, team: TeamArrays, walls: FloatArray, last: Clearances, smallest: float
) -> float:
    """Return the smallest distance of a piece to the walls until now, given that until before [m]."""
    placed = False
    for i in range(len(team.pieces)):
        if last.walls[i, 0] - (last.way[0] - last.walls[i, 1]) > smallest + ROUNDING:
            continue
        if not placed:
            place_pieces(team, z, last.vertices, last.discs)
            placed = True
        distance = piece_to_walls(team, last.vertices, last.discs, walls, i, inf)
        last.walls[i, 0], last.walls[i, 1] = distance, last.way[0]
        smallest = min(smallest, distance)
    return smallest


@compiled(borrows=True)
def smallest_apart(z: FloatArray, team: TeamArrays, last: Clearances, smallest: float) -> float:
    """Return the smallest distance of two bodies that must not touch until now, given that before [m]."""
    placed = False
    for k in range(len(team.pairs)):
        if last.pairs[k, 0] - (last.way[1] - last.pairs[k, 1]) > smallest + ROUNDING:
            continue
        if not placed:
            place_pieces(team, z, last.vertices, last.discs)
            placed = True
        distance = pair_apart(team, last.vertices, last.discs, k, inf)
        last.pairs[k, 0], last.pairs[k, 1] = distance, last.way[1]
        smallest = min(smallest, distance)
    return smallest
