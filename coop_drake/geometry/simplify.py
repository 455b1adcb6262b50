"""Fewer vertices for a polygon, inward only: what is kept lies inside what was given."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.geometry.distances import segments_cross, squared_distance, twice_area
from coop_drake.geometry.passage import IndexArray
from coop_drake.geometry.polygons import corners_of
from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray

DROP, PROLONG = 1, 2
"""What may be done at a vertex: leave it out, or let it and the next one make way for one new corner."""

SHARPEST_COSINE = 0.5
"""Prolonged edges that would meet in an obstacle corner sharper than 60 degrees stay as they are."""


def simplify_inward(polygon: Polygon, tolerance: float, slack: float = 0.0) -> Polygon:
    """Leave out convex vertices and prolong the neighbours of reflex edges, cheapest first.

    Every step cuts a triangle off that holds no other part of the boundary, and never more than the tolerance
    deep against the polygon given: the depths of nested steps add up.

    Args:
        polygon: The region, with holes or without [m].
        tolerance: Greatest depth that may be cut off [m].
        slack: Reflex vertices that stand out by less than this may be left out too: by so much the result may
            stick out of the polygon [m]. Zero keeps it inside up to rounding.

    Returns:
        The simplified polygon, oriented; the polygon itself where no step is possible.
    """
    oriented = shapely.orient_polygons(polygon)
    rings = corners_of(oriented)
    sizes = np.array([len(ring) for ring in rings])
    points = np.vstack(rings)
    starts = np.repeat(np.cumsum(sizes) - sizes, sizes)
    index = np.arange(len(points)) - starts
    following = starts + (index + 1) % np.repeat(sizes, sizes)
    preceding = starts + (index - 1) % np.repeat(sizes, sizes)
    alive = _simplify(points, following, preceding, tolerance, slack)
    first = np.cumsum(sizes) - sizes
    kept = [points[a : a + n][alive[a : a + n]] for a, n in zip(first, sizes, strict=True)]
    simple = Polygon(kept[0], kept[1:])
    return simple if simple.is_valid and simple.area > 0.0 else oriented


def vertex_angles(polygon: Polygon) -> FloatArray:
    """Interior angle at every vertex of every ring, shape (n,) [rad], in (0, 2 pi)."""
    angles = []
    for points in corners_of(shapely.orient_polygons(polygon)):
        arriving, leaving = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
        cross = arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0]
        angles.append(np.pi - np.arctan2(cross, (arriving * leaving).sum(axis=1)))
    return np.concatenate(angles)


def sharpest_angle(polygon: Polygon) -> float:
    """The smaller of the smallest interior angle and what the largest one lacks to a full turn [rad]."""
    angles = vertex_angles(polygon)
    return float(min(angles.min(), 2.0 * np.pi - angles.max()))


@compiled(borrows=True)
def _drop_depth(points: FloatArray, a: int, b: int, c: int, slack: float) -> float:
    """Depth that leaving out b cuts off; infinite where b is reflex by more than the slack."""
    ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
    cx, cy = points[c, 0], points[c, 1]
    depth = sqrt(squared_distance(bx, by, ax, ay, cx, cy))
    return depth if twice_area(ax, ay, bx, by, cx, cy) >= 0.0 or depth <= slack else inf


@compiled(borrows=True)
def _prolong(points: FloatArray, a: int, b: int, c: int, d: int) -> tuple[float, float, float]:
    """Where a b and d c, prolonged, meet beyond the reflex edge b c, and how far from it: (x, y, depth)."""
    ux, uy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    vx, vy = points[c, 0] - points[d, 0], points[c, 1] - points[d, 1]
    wx, wy = points[c, 0] - points[b, 0], points[c, 1] - points[b, 1]
    # Both ends are reflex, and the prolonged edges turn towards each other.
    if ux * wy - uy * wx >= 0.0 or vx * wy - vy * wx >= 0.0 or ux * vy - uy * vx <= 0.0:
        return 0.0, 0.0, inf
    if ux * vx + uy * vy > SHARPEST_COSINE * sqrt((ux * ux + uy * uy) * (vx * vx + vy * vy)):
        return 0.0, 0.0, inf
    s = (wx * vy - wy * vx) / (ux * vy - uy * vx)
    x, y = points[b, 0] + s * ux, points[b, 1] + s * uy
    squared = squared_distance(x, y, points[b, 0], points[b, 1], points[c, 0], points[c, 1])
    return x, y, sqrt(squared)


@compiled(borrows=True)
def _is_free(
    points: FloatArray,
    alive: NDArray[np.bool_],
    following: IndexArray,
    own: tuple[int, int, int, int],
    x: float,
    y: float,
) -> bool:
    """Whether triangle b, (x, y), c holds no vertex but ``own`` = a, b, c, d, and no edge cuts it."""
    a, b, c, d = own
    bx, by, cx, cy = points[b, 0], points[b, 1], points[c, 0], points[c, 1]
    turn = 1.0 if twice_area(bx, by, x, y, cx, cy) >= 0.0 else -1.0
    for v in range(points.shape[0]):
        if not alive[v]:
            continue
        px, py = points[v, 0], points[v, 1]
        if (
            v not in (a, b, c, d)
            and min(bx, x, cx) <= px <= max(bx, x, cx)
            and min(by, y, cy) <= py <= max(by, y, cy)
            and turn * twice_area(bx, by, x, y, px, py) >= -1e-12
            and turn * twice_area(x, y, cx, cy, px, py) >= -1e-12
            and turn * twice_area(cx, cy, bx, by, px, py) >= -1e-12
        ):
            return False
        w = following[v]
        if v in (a, b, c, d) or w in (a, b, c, d):
            continue
        qx, qy = points[w, 0], points[w, 1]
        for ex, ey in ((bx, by), (cx, cy)):
            if segments_cross(ex, ey, x, y, px, py, qx, qy):
                return False
    return True


@compiled(borrows=True)
def _best_step(
    points: FloatArray, around: tuple[int, int, int, int], error: FloatArray, tolerance: float, slack: float
) -> tuple[float, int]:
    """Depth of the cheaper step at b, added to what its edges have lost already, and which step it is."""
    a, b, c, d = around
    drop = max(error[a], error[b]) + _drop_depth(points, a, b, c, slack)
    _, _, depth = _prolong(points, a, b, c, d)
    prolong = max(error[a], error[b] + depth, error[c])
    if min(drop, prolong) > tolerance:
        return inf, 0
    return (drop, DROP) if drop <= prolong else (prolong, PROLONG)


@compiled
def _simplify(
    points: FloatArray, following: IndexArray, preceding: IndexArray, tolerance: float, slack: float
) -> NDArray[np.bool_]:
    """Take the cheapest free step until none is left; moves ``points`` and returns which ones are alive."""
    count = points.shape[0]
    alive = np.ones(count, dtype=np.bool_)
    error = np.zeros(count)
    cost, step, stale = np.full(count, inf), np.zeros(count, dtype=np.int64), np.ones(count, dtype=np.bool_)
    while True:
        best = -1
        for b in range(count):
            if not alive[b]:
                continue
            if stale[b]:
                around = (preceding[b], b, following[b], following[following[b]])
                cost[b], step[b] = _best_step(points, around, error, tolerance, slack)
                stale[b] = False
            if cost[b] < inf and (best < 0 or cost[b] < cost[best]):
                best = b
        if best < 0:
            return alive
        b = best
        a, c = preceding[b], following[b]
        d = following[c]
        if d == a:
            cost[b] = inf
            continue
        if step[b] == DROP:
            if not _is_free(points, alive, following, (a, a, c, b), points[b, 0], points[b, 1]):
                cost[b] = inf
                continue
            error[a] = cost[b]
            gone = b
        else:
            x, y, depth = _prolong(points, a, b, c, d)
            if not _is_free(points, alive, following, (a, b, c, d), x, y):
                cost[b] = inf
                continue
            lost = error[b] + depth
            error[a], error[b] = max(error[a], lost), max(error[c], lost)
            points[b, 0], points[b, 1] = x, y
            gone = c
        alive[gone] = False
        before, after = preceding[gone], following[gone]
        following[before], preceding[after] = after, before
        for v in (preceding[preceding[before]], preceding[before], before, after, following[after]):
            stale[v] = True
