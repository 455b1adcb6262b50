"""Compiled: whether walls on either side hold two discs so near to each other that these overlap."""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np

from coop_drake.geometry.distances import squared_distance
from coop_drake.geometry.sweeps import edge_directions, support
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

_BEYOND = 1e-3
"""How far below all points a limit is that cuts off all of them [m]."""

_SHORTEST = 1e-7
"""Shorter edges are remnants of rounding, with any direction [m]."""

_HALVINGS = 30
"""Halvings with which the place is found where an edge leaves the neighbourhood of a wall [-]."""


@compiled
def convex_hull(points: FloatArray) -> FloatArray:
    """Corners of the convex hull of points, counter-clockwise; shapes (n, 2) to (m, 2) [m].

    From the point furthest to the left it goes to the one that has no other one to its right, and so on.
    """
    first = 0
    for k in range(1, len(points)):
        lower = points[k, 0] == points[first, 0] and points[k, 1] < points[first, 1]
        first = k if points[k, 0] < points[first, 0] or lower else first
    corners, here = np.empty_like(points), first
    for count in range(len(points)):
        corners[count] = points[here]
        bx, by = 0.0, 0.0
        for k in range(len(points)):
            x, y = points[k, 0] - corners[count, 0], points[k, 1] - corners[count, 1]
            right = bx * y - by * x
            if right < 0.0 or (right == 0.0 and x * x + y * y > bx * bx + by * by):
                bx, by, here = x, y, k
        if points[here, 0] == points[first, 0] and points[here, 1] == points[first, 1]:
            return corners[: count + 1]
    return corners


@compiled(borrows=True)
def _nearer(x: float, y: float, wall: FloatArray, radius: float) -> bool:
    near: bool = squared_distance(x, y, wall[0], wall[1], wall[2], wall[3]) < radius * radius
    return near


@compiled
def furthest_clear(ring: FloatArray, ux: float, uy: float, wall: FloatArray, radius: float) -> float:
    """The largest u . x of points x of a convex ring that are no nearer to a wall than a radius [m].

    It is that of a corner, or of a point where an edge is at the distance ``radius`` from the wall, because
    the points nearer to it are a convex set. If all are nearer, it is below all u . x of the ring.
    Shapes: ring (n, 2), wall (4,) as (x0, y0, x1, y1) [m].
    """
    furthest: float = (ux * ring[:, 0] + uy * ring[:, 1]).min() - _BEYOND
    for i in range(len(ring)):
        ax, ay, bx, by = ring[i - 1, 0], ring[i - 1, 1], ring[i, 0], ring[i, 1]
        held, after = _nearer(ax, ay, wall, radius), _nearer(bx, by, wall, radius)
        if not after:
            furthest = max(furthest, ux * bx + uy * by)
        if held != after:
            if not held:
                ax, ay, bx, by = bx, by, ax, ay
            for _ in range(_HALVINGS):
                mx, my = 0.5 * (ax + bx), 0.5 * (ay + by)
                if _nearer(mx, my, wall, radius):
                    ax, ay = mx, my
                else:
                    bx, by = mx, my
            furthest = max(furthest, ux * bx + uy * by)
    return furthest


@compiled
def below(ring: FloatArray, ux: float, uy: float, most: float) -> FloatArray:
    """The part of a convex ring where u . x <= most; shapes (n, 2) to (m, 2), no rows if it is empty [m]."""
    found, count = np.empty((2 * len(ring), 2)), 0
    for i in range(len(ring)):
        ax, ay, bx, by = ring[i - 1, 0], ring[i - 1, 1], ring[i, 0], ring[i, 1]
        s, t = ux * ax + uy * ay - most, ux * bx + uy * by - most
        if (s <= 0.0) != (t <= 0.0):
            found[count, 0], found[count, 1] = (bx * s - ax * t) / (s - t), (by * s - ay * t) / (s - t)
            count += 1
        if t <= 0.0:
            found[count, 0], found[count, 1] = bx, by
            count += 1
    return found[:count]


@compiled
def _clear_part(
    ring: FloatArray, walls: FloatArray, radius: float, loss: float, cuts: FloatArray, count: int
) -> tuple[FloatArray, int]:
    """Cut off from the places of a disc's centre where it touches a wall; cuts (ux, uy, limit) are appended.

    Beyond the line u . x = limit all places are nearer to one wall than the radius; u is a wall's normal.
    """
    for k in range(2 * len(walls)):
        wall, side = walls[k // 2], 1.0 - 2.0 * (k % 2)
        ux, uy = side * (wall[3] - wall[1]), side * (wall[0] - wall[2])
        length = hypot(ux, uy)
        if length > 0.0 and len(ring) > 0:
            ux, uy = ux / length, uy / length
            limit = furthest_clear(ring, ux, uy, wall, radius - loss) + loss
            if (ux * ring[:, 0] + uy * ring[:, 1]).max() > limit + loss:
                cuts[count, 0], cuts[count, 1], cuts[count, 2] = ux, uy, limit
                ring, count = below(ring, ux, uy, limit + loss), count + 1
    return ring, count


@compiled
def squeezed(
    first: FloatArray,
    second: FloatArray,
    apart: FloatArray,
    walls: FloatArray,
    radii: FloatArray,
    loss: float,
) -> tuple[bool, FloatArray, int]:
    """Whether walls hold two discs so near to each other that they overlap.

    Cuts leave places of the first centre, a, and of the second one, b, beyond which a disc touches a wall. Of
    all vectors b - a from the slice, those that also lead from a place left to the first to one left to the
    second must be shorter than the sum of the radii.

    Args:
        first: Convex ring of all places of the first disc's centre, counter-clockwise, shape (n, 2) [m].
        second: That of the second one's.
        apart: Convex ring of all b - a, shape (m, 2) [m].
        walls: Walls near both, shape (k, 4) as (x0, y0, x1, y1) [m].
        radii: Their radii, shape (2,) [m].
        loss: What every statement must hold with to spare [m].

    Returns:
        Whether they overlap; cuts (ux, uy, limit), shape (c, 3); how many of them are the first disc's.
    """
    cuts = np.empty((4 * len(walls), 3))
    one, count = _clear_part(first, walls, radii[0], loss, cuts, 0)
    other, total = _clear_part(second, walls, radii[1], loss, cuts, count)
    if len(one) > 0 and len(other) > 0:
        for ring in (other, -one):
            normals = edge_directions(ring)
            room = support(other, normals) + support(-one, normals) + 3.0 * loss
            for k in range(len(normals)):
                length = hypot(
                    ring[k, 0] - ring[(k + 1) % len(ring), 0], ring[k, 1] - ring[(k + 1) % len(ring), 1]
                )
                if length > _SHORTEST and len(apart) > 0:
                    apart = below(apart, cos(normals[k]), sin(normals[k]), room[k])
        if len(apart) > 0 and np.hypot(apart[:, 0], apart[:, 1]).max() >= radii[0] + radii[1] - loss:
            return False, cuts[:0], 0
    return True, cuts[:total], count
