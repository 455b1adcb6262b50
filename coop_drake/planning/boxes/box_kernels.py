"""Compiled boxes along a path: the longest whose swept footprint stays clear of obstacles and of itself.

What these kernels call free is proved: they use the over-sweeps of eq. (6), a floor shrunk by more than
rounding errors, and the fact that a footprint at a distance c from all obstacles may move by less than c in
any direction.
"""

from __future__ import annotations

from math import hypot
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.body_pairs import TOUCH
from coop_drake.geometry.distances import separated
from coop_drake.geometry.sweep_kernels import over_piece
from coop_drake.planning.sampling.collision_kernels import ring_clearance
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid
from coop_drake.planning.travel_time import SETTLING_TIME, SPEED_PER_CLEARANCE
from coop_drake.tree.pose import FloatArray, IntArray
from coop_drake.tree.team_arrays import TeamArrays

COARSENESS = 0.15
"""A box may fall short of the longest one by this fraction of its samples [-]: fewer boxes are tried."""

_STEP_FRACTION = 0.5
"""Step along a path over the clearance there [-]: below 1, so that every place lies in a free disc."""


class BoxArrays(NamedTuple):
    """The team and the joint limits as arrays, used to test whether a box is free.

    Attributes:
        team: The team.
        frames: Pieces and numbers of stages that collision pairs need, each once, shape (F, 2).
        pairs: Pairs of rows of ``frames`` that must not touch, shape (K, 2).
        lower: Lower limits of (theta, q...), minus infinity for theta, shape (1 + n,).
        upper: Upper limits, shape (1 + n,).
    """

    team: TeamArrays
    frames: IntArray
    pairs: IntArray
    lower: FloatArray
    upper: FloatArray


@compiled
def enclosing_disc(ring: FloatArray, disc: FloatArray) -> None:
    """Write a disc (x, y, radius) that holds a ring, shape (n, 2) [m], into ``disc``, shape (3,) [m]."""
    disc[0], disc[1], disc[2] = 0.0, 0.0, 0.0
    for i in range(len(ring)):
        disc[0] += ring[i, 0] / len(ring)
        disc[1] += ring[i, 1] / len(ring)
    for i in range(len(ring)):
        disc[2] = max(disc[2], hypot(ring[i, 0] - disc[0], ring[i, 1] - disc[1]))


@compiled
def _with_ring(vertices: FloatArray, size: int, ring: FloatArray) -> FloatArray:
    """Write a ring into the rows from ``size`` on; returns a longer copy where there are too few, (V, 2)."""
    if size + len(ring) > len(vertices):
        longer = np.empty((2 * (size + len(ring)), 2))
        for k in range(size):
            longer[k, 0], longer[k, 1] = vertices[k, 0], vertices[k, 1]
        vertices = longer
    for k in range(len(ring)):
        vertices[size + k, 0], vertices[size + k, 1] = ring[k, 0], ring[k, 1]
    return vertices


@compiled
def bodies_apart(boxes: BoxArrays, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether no two bodies touch anywhere in a box: their over-sweeps are separated.

    Args:
        boxes: The team.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
    """
    count = len(boxes.frames)
    vertices, first = np.empty((32 * count, 2)), np.zeros(count + 1, np.int64)
    discs = np.empty((count, 3))
    for k in range(count):
        ring = over_piece(boxes.team, boxes.frames[k, 0], lower, upper, boxes.frames[k, 1], True)
        enclosing_disc(ring, discs[k])
        vertices = _with_ring(vertices, first[k], ring)
        first[k + 1] = first[k] + len(ring)
    for k in range(len(boxes.pairs)):
        i, j = boxes.pairs[k, 0], boxes.pairs[k, 1]
        far = hypot(discs[i, 0] - discs[j, 0], discs[i, 1] - discs[j, 1])
        if far <= discs[i, 2] + discs[j, 2] + 2.0 * TOUCH and not separated(
            vertices[first[i] : first[i + 1]], vertices[first[j] : first[j + 1]], TOUCH
        ):
            return False
    return True


@compiled
def box_clearance(
    boxes: BoxArrays,
    grid: ObstacleGrid,
    lower: FloatArray,
    upper: FloatArray,
    path: FloatArray,
    start: int,
    end: int,
    enough: float,
) -> float:
    """Least distance of the swept team from the obstacles while its position follows a part of a path.

    The path is walked in steps shorter than the distance found at each place, so that everything within half
    of that distance is proved free, too.

    Args:
        boxes: The team.
        grid: The floor, which holds the team at the first position for some angles of the box.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        path: Configurations or positions p_WL, joined by straight lines, shape (m, 2 or more) [m].
        start: First row of the part.
        end: Its last row.
        enough: Distance that is needed at the first and at the last position; half of it in between [m].

    Returns:
        The distance [m]; -1 if it falls short or bodies may touch.
    """
    count = len(boxes.team.radii)
    vertices, first = np.empty((32 * count, 2)), np.zeros(count + 1, np.int64)
    discs = np.empty((count, 3))
    for k in range(count):
        ring = over_piece(boxes.team, count - 1 - k, lower, upper, len(boxes.team.links), True)
        enclosing_disc(ring, discs[k])
        vertices = _with_ring(vertices, first[k], ring)
        first[k + 1] = first[k] + len(ring)
        for at in (start, end):
            x, y = path[at, 0], path[at, 1]
            if (
                ring_clearance(
                    grid, vertices, first[k], first[k + 1], 0.0, discs[k], x, y, 1.0, 0.0, 2.0 * enough
                )
                <= enough
            ):
                return -1.0
    if not bodies_apart(boxes, lower, upper):
        return -1.0
    least, passed = np.inf, 0.0
    for at in range(start, end + 1):
        dx, dy, length = 0.0, 0.0, 0.0
        if at < end:
            dx, dy = path[at + 1, 0] - path[at, 0], path[at + 1, 1] - path[at, 1]
            length = hypot(dx, dy)
        while passed <= length:
            x, y = path[at, 0], path[at, 1]
            if length > 0.0:
                x += passed / length * dx
                y += passed / length * dy
            here = np.inf
            for k in range(count):
                here = ring_clearance(
                    grid, vertices, first[k], first[k + 1], 0.0, discs[k], x, y, 1.0, 0.0, here
                )
                if here <= 0.5 * enough:
                    return -1.0
            least = min(least, here)
            passed += _STEP_FRACTION * here
        passed -= length
    return least


@compiled
def clearances_in_box(
    boxes: BoxArrays,
    grid: ObstacleGrid,
    lower: FloatArray,
    upper: FloatArray,
    path: FloatArray,
    start: int,
    end: int,
    most: float,
) -> FloatArray:
    """Distance of the swept team from the obstacles at some rows of a path.

    Args:
        boxes: With the next six as in ``box_clearance``.
        grid: The floor.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        path: Configurations, shape (m, 3 + n) [m, rad].
        start: First row.
        end: Last row.
        most: Distances above this one do not matter [m].

    Returns:
        Distances, shape (end - start + 1,) [m]; of shape (0,) if one row is not free or bodies may touch.
    """
    result = np.empty(end + 1 - start)
    for k in range(len(result)):
        result[k] = most
    disc = np.empty(3)
    for piece in range(len(boxes.team.radii) - 1, -1, -1):
        ring = over_piece(boxes.team, piece, lower, upper, len(boxes.team.links), True)
        enclosing_disc(ring, disc)
        for k in range(len(result)):
            x, y = path[start + k, 0], path[start + k, 1]
            result[k] = ring_clearance(grid, ring, 0, len(ring), 0.0, disc, x, y, 1.0, 0.0, result[k])
            if result[k] < 0.0:
                return result[:0]
    return result if bodies_apart(boxes, lower, upper) else result[:0]


@compiled
def padded(
    boxes: BoxArrays, path: FloatArray, start: int, end: int, pad: float
) -> tuple[FloatArray, FloatArray]:
    """Compute intervals of (theta, q...) that hold some rows of a path, padded and clipped at joint limits.

    Args:
        boxes: The team.
        path: Configurations, shape (m, 3 + n) [m, rad].
        start: First row.
        end: Last row.
        pad: Padding: at least this [rad, m], and at least this fraction of the interval [-].

    Returns:
        Lower and upper ends, shape (1 + n,) each.
    """
    lower, upper = np.empty(path.shape[1] - 2), np.empty(path.shape[1] - 2)
    for axis in range(len(lower)):
        low, high = path[start, 2 + axis], path[start, 2 + axis]
        for k in range(start + 1, end + 1):
            low, high = min(low, path[k, 2 + axis]), max(high, path[k, 2 + axis])
        grow = max(pad, pad * (high - low))
        lower[axis] = max(boxes.lower[axis], low - grow)
        upper[axis] = min(boxes.upper[axis], high + grow)
    return lower, upper


@compiled
def longest_box(
    boxes: BoxArrays,
    grid: ObstacleGrid,
    samples: FloatArray,
    first: int,
    guess: int,
    pad: float,
    clearance: float,
    margin: float,
) -> tuple[int, int, int]:
    """Find about how far along a path one free box reaches: doubling, then bisection.

    Args:
        boxes: The team.
        grid: The floor, from which the margin has been taken off.
        samples: The path, shape (m, 3 + n).
        first: Sample that the box begins with.
        guess: By how many samples to reach out at first.
        pad: Padding of the intervals, see ``padded``.
        clearance: Distance from the obstacles that is needed at both ends [m].
        margin: Clearance that positions have beyond that floor [m].

    Returns:
        The last sample of the box that is passed quickest (``first`` if there is none), that of the longest
        one, and the number of boxes tried.
    """
    last = len(samples) - 1
    best, failed, reach = first, last + 1, 1
    quickest, fastest, trials = first, 0.0, 0
    length, measured = 0.0, first
    while failed - best > max(1, int(COARSENESS * (best - first))):
        j = min(best + reach, last) if failed > last else (best + failed) // 2
        lower, upper = padded(boxes, samples, first, j, pad)
        trials += 1
        found = box_clearance(boxes, grid, lower, upper, samples, first, j, clearance)
        if found < 0.0:
            failed = j
            continue
        reach = guess if best == first else 2 * reach
        best = j
        while measured < j:
            dx, dy = (
                samples[measured + 1, 0] - samples[measured, 0],
                samples[measured + 1, 1] - samples[measured, 1],
            )
            length += hypot(dx, dy)
            measured += 1
        pace = (j - first) / (SETTLING_TIME + length / (SPEED_PER_CLEARANCE * max(margin + found, 1e-3)))
        if pace > fastest:
            quickest, fastest = j, pace
    return quickest, best, trials
