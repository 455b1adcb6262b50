"""Compiled boxes along a path: the longest whose swept footprint stays clear of obstacles and of itself.

What these kernels call free is proved: they use the over-sweeps of eq. (6), a floor shrunk by more than
rounding errors, and the fact that a footprint at a distance c from all obstacles may move by less than c in
any direction.
"""

from __future__ import annotations

from math import hypot

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.planning.boxes.box_sweeps import (
    BoxArrays,
    bodies_apart,
    enclosing_disc,
    room_for_sweeps,
    swept_piece,
    with_ring,
)
from coop_drake.planning.sampling.collision_kernels import ring_clearance
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid
from coop_drake.planning.travel_time import SETTLING_TIME, SPEED_PER_CLEARANCE
from coop_drake.tree.pose import FloatArray

COARSENESS = 0.2
"""A box may fall short of the longest one by this fraction of its samples [-]: fewer boxes are tried."""

_GROWTH = 0.5
"""Samples by which a free box is made longer, over those that it holds [-]."""

_STEP_FRACTION = 0.5
"""Step along a path over the clearance there [-]: below 1, so that every place lies in a free disc."""


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
    needed, row = len(boxes.pair_sweeps), 0
    sweeps, swept = room_for_sweeps(needed), np.empty((16 * needed, 2))
    for k in range(count):
        ring, swept, row = swept_piece(boxes, count - 1 - k, lower, upper, sweeps, swept, row)
        enclosing_disc(ring, discs[k])
        vertices = with_ring(vertices, first[k], ring)
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
    if not bodies_apart(boxes, sweeps, swept):
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
    needed, row = len(boxes.pair_sweeps), 0
    sweeps, swept = room_for_sweeps(needed), np.empty((16 * needed, 2))
    for piece in range(len(boxes.team.radii) - 1, -1, -1):
        ring, swept, row = swept_piece(boxes, piece, lower, upper, sweeps, swept, row)
        enclosing_disc(ring, disc)
        for k in range(len(result)):
            x, y = path[start + k, 0], path[start + k, 1]
            result[k] = ring_clearance(grid, ring, 0, len(ring), 0.0, disc, x, y, 1.0, 0.0, result[k])
            if result[k] < 0.0:
                return result[:0]
    return result if bodies_apart(boxes, sweeps, swept) else result[:0]


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
    """Find about how far along a path one free box reaches: longer ones by half, then bisection.

    Args:
        boxes: The team.
        grid: The floor, from which the margin has been taken off.
        samples: The path, shape (m, 3 + n).
        first: Sample that the box begins with.
        guess: Sample after the first one at which the first box that is tried ends; about where it ends.
        pad: Padding of the intervals, see ``padded``.
        clearance: Distance from the obstacles that is needed at both ends [m].
        margin: Clearance that positions have beyond that floor [m].

    Returns:
        The last sample of the box that is passed quickest (``first`` if there is none), that of the longest
        one, and the number of boxes tried.
    """
    last = len(samples) - 1
    best, failed, reach = first, last + 1, guess
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
        best, reach = j, max(1, int(_GROWTH * (j - first)))
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
