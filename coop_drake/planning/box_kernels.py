"""Compiled clearance of a box of configurations from the walls: it chooses boxes and proves nothing."""

from __future__ import annotations

from math import hypot, sqrt

import numba
import numpy as np

from coop_drake.geometry.body_pairs import TOUCH
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.sweep_kernels import IntArray, SweepArrays, over_piece, separated
from coop_drake.planning.collision_kernels import point_segment


@numba.njit(cache=True)
def _crosses(ring: FloatArray, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether a segment meets a convex polygon."""
    enter, leave = 0.0, 1.0
    for i in range(len(ring)):
        k = i + 1 if i + 1 < len(ring) else 0
        nx, ny = ring[k, 1] - ring[i, 1], ring[i, 0] - ring[k, 0]
        room = nx * (ring[i, 0] - ax) + ny * (ring[i, 1] - ay)
        rate = nx * (bx - ax) + ny * (by - ay)
        if rate > 0.0:
            leave = min(leave, room / rate)
        elif rate < 0.0:
            enter = max(enter, room / rate)
        elif room < 0.0:
            return False
        if enter > leave:
            return False
    return True


@numba.njit(cache=True)
def _squared_gap(ring: FloatArray, ax: float, ay: float, bx: float, by: float, best: float) -> float:
    """Squared distance of a segment from a convex polygon that it does not meet; ``best`` if less."""
    for i in range(len(ring)):
        k = i + 1 if i + 1 < len(ring) else 0
        x, y = ring[i]
        best = min(best, point_segment(x, y, ax, ay, bx, by))
        best = min(best, point_segment(ax, ay, x, y, ring[k, 0], ring[k, 1]))
    return best


@numba.njit(cache=True)
def ring_clearance(ring: FloatArray, walls: FloatArray, positions: FloatArray, most: float) -> float:
    """Least distance of a convex polygon from the walls wherever it stands, -1 if it meets one.

    Args:
        ring: Vertices relative to the position, counter-clockwise, shape (n, 2) [m].
        walls: Edges (x0, y0, x1, y1) of closed rings, shape (E, 4) [m].
        positions: Where it stands, shape (k, 2) [m].
        most: Distances above this one do not matter [m].
    """
    cx, cy = ring[:, 0].mean(), ring[:, 1].mean()
    reach = 0.0
    for i in range(len(ring)):
        reach = max(reach, hypot(ring[i, 0] - cx, ring[i, 1] - cy))
    best = most
    for p in range(len(positions)):
        x, y = positions[p]
        for e in range(len(walls)):
            ax, ay, bx, by = walls[e, 0] - x, walls[e, 1] - y, walls[e, 2] - x, walls[e, 3] - y
            if point_segment(cx, cy, ax, ay, bx, by) >= (reach + best) ** 2:
                continue
            if _crosses(ring, ax, ay, bx, by):
                return -1.0
            best = sqrt(_squared_gap(ring, ax, ay, bx, by, best * best))
    return best


@numba.njit(cache=True)
def box_clearance(
    sweeps: SweepArrays,
    pairs: IntArray,
    walls: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    positions: FloatArray,
    enough: float,
) -> float:
    """Least distance of the swept team from the walls along some positions.

    Args:
        sweeps: The team's pieces.
        pairs: Pairs of pieces and their stages to the common component, shape (k, 4).
        walls: Edges (x0, y0, x1, y1) of the workspace, shape (E, 4) [m].
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        positions: Positions p_WL, shape (k, 2) [m].
        enough: Distance that is needed at the first and at the last of them [m].

    Returns:
        The distance; -1 if a wall is crossed, bodies may touch or an end has not enough.
    """
    ends = np.stack((positions[0], positions[-1]))
    count = len(sweeps.radius)
    for piece in range(count - 1, -1, -1):
        stages = sweeps.first_stage[piece + 1] - sweeps.first_stage[piece]
        ring = over_piece(sweeps, piece, lower, upper, stages, True)
        if ring_clearance(ring, walls, ends, 2.0 * enough) <= enough:
            return -1.0
    for k in range(len(pairs)):
        i, j, first_stages, second_stages = pairs[k]
        first = over_piece(sweeps, i, lower, upper, first_stages, True)
        if not separated(first, over_piece(sweeps, j, lower, upper, second_stages, True), TOUCH):
            return -1.0
    best: float = np.inf
    for piece in range(count - 1, -1, -1):
        stages = sweeps.first_stage[piece + 1] - sweeps.first_stage[piece]
        best = ring_clearance(over_piece(sweeps, piece, lower, upper, stages, True), walls, positions, best)
        if best < 0.0:
            return -1.0
    return best
