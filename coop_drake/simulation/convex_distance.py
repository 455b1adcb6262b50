"""Exact signed distances of convex footprints to walls and to each other, compiled.

A footprint is the hull of its core's vertices grown by a radius; all the work is done on the core's edges.
Cores have one vertex (disc), two (capsule) or more (counter-clockwise polygon).
"""

from __future__ import annotations

from math import hypot, inf

import numpy as np
from numpy.typing import NDArray

from coop_drake.compiled import compiled
from coop_drake.tree.pose import FloatArray

__all__ = ["core_distance", "nearest_pair", "nearest_to_walls", "wall_distance"]

IntArray = NDArray[np.int64]

#: What is farther away than something else by more than this is so despite rounding [m].
_ROUNDING = 1e-9


@compiled
def wall_distance(core: FloatArray, walls: FloatArray) -> float:
    """Signed distance of a core to the walls: positive inside the floor, minus the depth outside it.

    Args:
        core: Vertices in W, shape (v, 2) [m].
        walls: Every edge of the floor's rings as (x, y, x, y), shape (w, 4) [m].
    """
    nearest = inf
    depth = 0.0
    count = core.shape[0]
    for w in range(walls.shape[0]):
        nearest = min(nearest, _ring_to_wall(core, walls[w]))
        if _core_holds(core, walls[w, 0], walls[w, 1]):
            depth = max(depth, _ring_distance(core, walls[w, 0], walls[w, 1]))
            nearest = 0.0
    for i in range(count):
        if not _floor_holds(walls, core[i, 0], core[i, 1]):
            depth = max(depth, _walls_to_point(walls, core[i, 0], core[i, 1]))
            nearest = 0.0
    return nearest if nearest > 0.0 else -depth


@compiled
def core_distance(first: FloatArray, second: FloatArray) -> float:
    """Signed distance of two cores: minus the depth of the deepest vertex where they overlap.

    Args:
        first: Vertices in W, shape (v, 2) [m].
        second: Vertices in W, shape (u, 2) [m].
    """
    nearest = inf
    n, m = first.shape[0], second.shape[0]
    for i in range(n):
        k = (i + 1) % n
        for j in range(m):
            h = (j + 1) % m
            nearest = min(
                nearest,
                _segment_distance(
                    first[i, 0], first[i, 1], first[k, 0], first[k, 1],
                    second[j, 0], second[j, 1], second[h, 0], second[h, 1],
                ),
            )  # fmt: skip
    depth = 0.0
    for i in range(n):
        if _core_holds(second, first[i, 0], first[i, 1]):
            depth = max(depth, _ring_distance(second, first[i, 0], first[i, 1]))
            nearest = 0.0
    for j in range(m):
        if _core_holds(first, second[j, 0], second[j, 1]):
            depth = max(depth, _ring_distance(first, second[j, 0], second[j, 1]))
            nearest = 0.0
    return nearest if nearest > 0.0 else -depth


@compiled
def nearest_to_walls(placed: FloatArray, pieces: FloatArray, walls: FloatArray) -> tuple[float, int]:
    """Smallest signed distance of several footprints to the walls, and whose it is.

    Walls are looked at only where a footprint's box leaves room for them to be the nearest.

    Args:
        placed: Vertices of all cores in W, shape (v, 2) [m].
        pieces: For each core its first vertex, the one after its last, and by how much it is grown [m],
            shape (cores, 3).
        walls: As in `wall_distance`.
    """
    nearest, which = inf, 0
    for i in range(pieces.shape[0]):
        radius = pieces[i, 2]
        distance = _wall_distance_within(_core(placed, pieces, i), walls, nearest + radius) - radius
        if distance < nearest:
            nearest, which = distance, i
    return nearest, which


@compiled
def _wall_distance_within(core: FloatArray, walls: FloatArray, limit: float) -> float:
    """`wall_distance` where it is below a limit, else anything from the limit on."""
    low_x, low_y, high_x, high_y = _box(core)
    first, least = 0, inf
    for w in range(walls.shape[0]):
        gap = _squared_gap(walls[w], low_x, low_y, high_x, high_y)
        if gap < least:
            first, least = w, gap
    nearest = _ring_to_wall(core, walls[first])
    for w in range(walls.shape[0]):
        reach = max(min(nearest, limit), 0.0) + _ROUNDING
        if _squared_gap(walls[w], low_x, low_y, high_x, high_y) > reach * reach:
            continue
        nearest = min(nearest, _ring_to_wall(core, walls[w]))
        if nearest <= _ROUNDING or _core_holds(core, walls[w, 0], walls[w, 1]):
            return wall_distance(core, walls)
    # A core that no wall meets is on one side of them all.
    if not _floor_holds(walls, core[0, 0], core[0, 1]):
        return wall_distance(core, walls)
    return nearest


@compiled
def _squared_gap(wall: FloatArray, low_x: float, low_y: float, high_x: float, high_y: float) -> float:
    """Squared distance of a box from that about a wall."""
    dx = max(0.0, max(min(wall[0], wall[2]) - high_x, low_x - max(wall[0], wall[2])))
    dy = max(0.0, max(min(wall[1], wall[3]) - high_y, low_y - max(wall[1], wall[3])))
    return dx * dx + dy * dy


@compiled
def _ring_to_wall(core: FloatArray, wall: FloatArray) -> float:
    """Distance of a core's edges to a wall, zero where they cross."""
    nearest = inf
    count = core.shape[0]
    for i in range(count):
        j = (i + 1) % count
        distance = _segment_distance(
            core[i, 0], core[i, 1], core[j, 0], core[j, 1], wall[0], wall[1], wall[2], wall[3]
        )
        nearest = min(nearest, distance)
    return nearest


@compiled
def nearest_pair(placed: FloatArray, pieces: FloatArray, pairs: IntArray) -> tuple[float, int]:
    """Smallest signed distance of some pairs of footprints, shape (pairs, 2), and which pair's it is.

    Other arguments as in `nearest_to_walls`. Pairs whose boxes are farther apart are not looked at.
    """
    boxes = np.empty((pieces.shape[0], 4))
    for i in range(pieces.shape[0]):
        low_x, low_y, high_x, high_y = _box(_core(placed, pieces, i))
        boxes[i, 0], boxes[i, 1] = low_x - pieces[i, 2], low_y - pieces[i, 2]
        boxes[i, 2], boxes[i, 3] = high_x + pieces[i, 2], high_y + pieces[i, 2]
    nearest, which = inf, 0
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        apart_x = max(boxes[i, 0] - boxes[j, 2], boxes[j, 0] - boxes[i, 2])
        apart_y = max(boxes[i, 1] - boxes[j, 3], boxes[j, 1] - boxes[i, 3])
        if max(apart_x, apart_y) > nearest:
            continue
        between = core_distance(_core(placed, pieces, i), _core(placed, pieces, j))
        distance = between - pieces[i, 2] - pieces[j, 2]
        if distance < nearest:
            nearest, which = distance, k
    return nearest, which


@compiled
def _core(placed: FloatArray, pieces: FloatArray, index: int) -> FloatArray:
    core: FloatArray = placed[int(pieces[index, 0]) : int(pieces[index, 1])]
    return core


@compiled
def _box(core: FloatArray) -> tuple[float, float, float, float]:
    low_x, low_y, high_x, high_y = inf, inf, -inf, -inf
    for i in range(core.shape[0]):
        low_x, low_y = min(low_x, core[i, 0]), min(low_y, core[i, 1])
        high_x, high_y = max(high_x, core[i, 0]), max(high_y, core[i, 1])
    return low_x, low_y, high_x, high_y


@compiled
def _point_distance(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    dx, dy = bx - ax, by - ay
    length = dx * dx + dy * dy
    t = 0.0 if length == 0.0 else min(1.0, max(0.0, ((px - ax) * dx + (py - ay) * dy) / length))
    return hypot(px - ax - t * dx, py - ay - t * dy)


@compiled
def _side(ax: float, ay: float, bx: float, by: float, px: float, py: float) -> float:
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@compiled
def _segment_distance(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:
    if _side(ax, ay, bx, by, cx, cy) * _side(ax, ay, bx, by, dx, dy) < 0.0 and (
        _side(cx, cy, dx, dy, ax, ay) * _side(cx, cy, dx, dy, bx, by) < 0.0
    ):
        return 0.0
    # Segments that do not cross are nearest at an end of one of them.
    return min(
        min(_point_distance(ax, ay, cx, cy, dx, dy), _point_distance(bx, by, cx, cy, dx, dy)),
        min(_point_distance(cx, cy, ax, ay, bx, by), _point_distance(dx, dy, ax, ay, bx, by)),
    )


@compiled
def _core_holds(core: FloatArray, px: float, py: float) -> bool:
    count = core.shape[0]
    if count < 3:
        return False
    for i in range(count):
        j = (i + 1) % count
        if _side(core[i, 0], core[i, 1], core[j, 0], core[j, 1], px, py) < 0.0:
            return False
    return True


@compiled
def _ring_distance(core: FloatArray, px: float, py: float) -> float:
    nearest = inf
    count = core.shape[0]
    for i in range(count):
        j = (i + 1) % count
        nearest = min(nearest, _point_distance(px, py, core[i, 0], core[i, 1], core[j, 0], core[j, 1]))
    return nearest


@compiled
def _walls_to_point(walls: FloatArray, px: float, py: float) -> float:
    nearest = inf
    for w in range(walls.shape[0]):
        nearest = min(nearest, _point_distance(px, py, walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]))
    return nearest


@compiled
def _floor_holds(walls: FloatArray, px: float, py: float) -> bool:
    inside = False
    for w in range(walls.shape[0]):
        ax, ay, bx, by = walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]
        if (ay > py) != (by > py) and px < ax + (py - ay) * (bx - ax) / (by - ay):
            inside = not inside
    return inside
