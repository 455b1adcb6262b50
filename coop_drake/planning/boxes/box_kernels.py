"""Compiled boxes along a path: the longest whose swept footprint stays clear of walls and of itself.

What these kernels call free is proved: they use the over-sweeps of eq. (6), a floor shrunk by a hair, and
the fact that a footprint at a distance c from all walls may move by less than c in any direction.
"""

from __future__ import annotations

from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.body_pairs import TOUCH
from coop_drake.geometry.sweep_kernels import IntArray, SweepArrays, over_piece, separated
from coop_drake.planning.sampling.obstacle_grid import Walls, point_segment, square_at
from coop_drake.tree.pose import FloatArray

COARSENESS = 0.15
"""A box may fall short of the longest one by this share of its samples [-]."""

_STEP_SHARE = 0.5
_BOX_TIME = 0.6
_SPEED = 3.0


class BoxArrays(NamedTuple):
    """What boxes are tried with.

    Attributes:
        sweeps: The team's pieces.
        frames: Pieces and numbers of stages that collision pairs need, each once, shape (F, 2).
        pairs: Pairs of rows of ``frames`` that must not touch, shape (K, 2).
        lower: Lower limits of (theta, q...), minus infinity for theta, shape (1 + n,).
        upper: Upper limits, shape (1 + n,).
    """

    sweeps: SweepArrays
    frames: IntArray
    pairs: IntArray
    lower: FloatArray
    upper: FloatArray


@compiled
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


@compiled
def _squared_gap(ring: FloatArray, ax: float, ay: float, bx: float, by: float, best: float) -> float:
    """Squared distance of a segment from a convex polygon that it does not meet; ``best`` if less."""
    for i in range(len(ring)):
        k = i + 1 if i + 1 < len(ring) else 0
        x, y = ring[i, 0], ring[i, 1]
        best = min(best, point_segment(x, y, ax, ay, bx, by))
        best = min(best, point_segment(ax, ay, x, y, ring[k, 0], ring[k, 1]))
    return best


@compiled
def ring_clearance(
    ring: FloatArray, disc: FloatArray, walls: Walls, x: float, y: float, most: float
) -> float:
    """Distance of a convex polygon from the walls, at most ``most``; -1 if it meets one or leaves the grid.

    Args:
        ring: Vertices relative to the position, counter-clockwise, shape (n, 2) [m].
        disc: A disc (x, y, radius) that holds the ring, shape (3,) [m].
        walls: The floor.
        x: Where it stands [m].
        y: Where it stands [m].
        most: Distances above this one do not matter [m].
    """
    cx, cy, radius = disc[0], disc[1], disc[2]
    square = square_at(walls, x + cx, y + cy)
    if square < 0:
        return -1.0
    off = hypot(
        x + cx - walls.corner[0] - (square // walls.rows + 0.5) * walls.side,
        y + cy - walls.corner[1] - (square % walls.rows + 0.5) * walls.side,
    )
    near = radius <= walls.reach
    best = min(most, walls.reach - radius) if near else most
    first = walls.first[square] if near else 0
    last = walls.first[square + 1] if near else len(walls.edges)
    for k in range(first, last):
        if near and walls.away[k] > off + radius + best:
            break
        e = walls.listed[k] if near else k
        ax, ay, bx, by = (
            walls.edges[e, 0] - x,
            walls.edges[e, 1] - y,
            walls.edges[e, 2] - x,
            walls.edges[e, 3] - y,
        )
        if point_segment(cx, cy, ax, ay, bx, by) >= (radius + best) ** 2:
            continue
        if _crosses(ring, ax, ay, bx, by):
            return -1.0
        best = sqrt(_squared_gap(ring, ax, ay, bx, by, best * best))
    return best


@compiled
def enclosing_disc(ring: FloatArray) -> FloatArray:
    """A disc (x, y, radius) that holds a ring."""
    disc = np.zeros(3)
    for i in range(len(ring)):
        disc[0] += ring[i, 0] / len(ring)
        disc[1] += ring[i, 1] / len(ring)
    for i in range(len(ring)):
        disc[2] = max(disc[2], hypot(ring[i, 0] - disc[0], ring[i, 1] - disc[1]))
    return disc


@compiled
def bodies_apart(boxes: BoxArrays, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether no two bodies touch anywhere in a box."""
    rings = [
        over_piece(boxes.sweeps, boxes.frames[k, 0], lower, upper, boxes.frames[k, 1], True)
        for k in range(len(boxes.frames))
    ]
    discs = [enclosing_disc(ring) for ring in rings]
    for k in range(len(boxes.pairs)):
        i, j = boxes.pairs[k, 0], boxes.pairs[k, 1]
        far = hypot(discs[i][0] - discs[j][0], discs[i][1] - discs[j][1])
        if far <= discs[i][2] + discs[j][2] + 2.0 * TOUCH and not separated(rings[i], rings[j], TOUCH):
            return False
    return True


@compiled
def box_clearance(
    boxes: BoxArrays, walls: Walls, lower: FloatArray, upper: FloatArray, way: FloatArray, enough: float
) -> float:
    """Least distance of the swept team from the walls along a way of its position.

    The way is walked in steps shorter than the distance found at each place, so that everything within half
    of that distance is proved free, too.

    Args:
        boxes: The team.
        walls: The floor, which holds the team at the way's first position for some angles of the box.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        way: Positions p_WL, joined by straight lines, shape (k, 2) [m].
        enough: Distance that is needed at the first and at the last of them; half of it on the way [m].

    Returns:
        The distance; -1 if it falls short or bodies may touch.
    """
    rings, discs = [np.empty((0, 2))], [np.empty(0)]
    count = len(boxes.sweeps.radius)
    for piece in range(count - 1, -1, -1):
        stages = boxes.sweeps.first_stage[piece + 1] - boxes.sweeps.first_stage[piece]
        ring = over_piece(boxes.sweeps, piece, lower, upper, stages, True)
        disc = enclosing_disc(ring)
        for k in (0, len(way) - 1):
            if ring_clearance(ring, disc, walls, way[k, 0], way[k, 1], 2.0 * enough) <= enough:
                return -1.0
        rings.append(ring)
        discs.append(disc)
    if not bodies_apart(boxes, lower, upper):
        return -1.0
    least, passed = np.inf, 0.0
    for k in range(len(way)):
        x, y = way[k, 0], way[k, 1]
        length = hypot(way[k + 1, 0] - x, way[k + 1, 1] - y) if k + 1 < len(way) else 0.0
        while passed <= length:
            px, py = x, y
            if length > 0.0:
                px += passed / length * (way[k + 1, 0] - x)
                py += passed / length * (way[k + 1, 1] - y)
            here = np.inf
            for piece in range(1, count + 1):
                here = ring_clearance(rings[piece], discs[piece], walls, px, py, here)
                if here <= 0.5 * enough:
                    return -1.0
            least = min(least, here)
            passed += _STEP_SHARE * here
        passed -= length
    return least


@compiled
def padded(boxes: BoxArrays, part: FloatArray, pad: float) -> tuple[FloatArray, FloatArray]:
    """Intervals of (theta, q...) that hold some samples, padded, joints clipped at their limits.

    Args:
        boxes: The team.
        part: Samples of a path, shape (k, 3 + n).
        pad: Padding, at least and in shares of the interval.
    """
    lower, upper = part[0, 2:].copy(), part[0, 2:].copy()
    for axis in range(len(lower)):
        for k in range(1, len(part)):
            lower[axis] = min(lower[axis], part[k, 2 + axis])
            upper[axis] = max(upper[axis], part[k, 2 + axis])
        grow = max(pad, pad * (upper[axis] - lower[axis]))
        lower[axis] = max(boxes.lower[axis], lower[axis] - grow)
        upper[axis] = min(boxes.upper[axis], upper[axis] + grow)
    return lower, upper


@compiled
def longest_box(
    boxes: BoxArrays,
    walls: Walls,
    samples: FloatArray,
    first: int,
    guess: int,
    pad: float,
    room: float,
    margin: float,
) -> tuple[int, int, int]:
    """Find about how far along a path one free box reaches: doubling, then bisection.

    Args:
        boxes: The team.
        walls: The floor, from which the margin has been taken off.
        samples: The path, shape (m, 3 + n).
        first: Sample that the box begins with.
        guess: By how many samples to reach out at first.
        pad: Padding of the intervals.
        room: Distance from the walls that is needed at both ends [m].
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
        part = samples[first : j + 1]
        lower, upper = padded(boxes, part, pad)
        trials += 1
        clearance = box_clearance(boxes, walls, lower, upper, part[:, :2], room)
        if clearance < 0.0:
            failed = j
            continue
        reach = guess if best == first else 2 * reach
        best = j
        while measured < j:
            step = samples[measured + 1, :2] - samples[measured, :2]
            length += hypot(step[0], step[1])
            measured += 1
        pace = (j - first) / (_BOX_TIME + length / (_SPEED * max(margin + clearance, 1e-3)))
        if pace > fastest:
            quickest, fastest = j, pace
    return quickest, best, trials
