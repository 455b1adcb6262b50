"""Simple shapes: fewer vertices, inward only, and the cell that can be mapped of a safe region."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import inf, sqrt

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Point, Polygon

from coop_drake.errors import GeometryError
from coop_drake.geometry.passage import IndexArray, PassageFinder
from coop_drake.geometry.polygons import (
    BoundaryDistance,
    component_at,
    corners_of,
    extent_of,
    segments_cross,
    squared_distance,
    twice_area,
)
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray

# Fewer vertices for a polygon, inward only: what is kept lies inside what was given.

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


def sharpest_angle(polygon: Polygon) -> float:
    """The smaller of the smallest interior angle and what the largest one lacks to a full turn [rad]."""
    sharpest = np.pi
    for points in corners_of(shapely.orient_polygons(polygon)):
        arriving, leaving = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
        cross = arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0]
        angles = np.pi - np.arctan2(cross, (arriving * leaving).sum(axis=1))
        sharpest = min(sharpest, float(angles.min()), float(2.0 * np.pi - angles.max()))
    return sharpest


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
                # The depth of the cheaper step, added to what its edges have lost already. A vertex that is
                # reflex by more than the slack is never left out.
                a, c = preceding[b], following[b]
                ax, ay, bx, by = points[a, 0], points[a, 1], points[b, 0], points[b, 1]
                cx, cy = points[c, 0], points[c, 1]
                depth = sqrt(squared_distance(bx, by, ax, ay, cx, cy))
                kept = twice_area(ax, ay, bx, by, cx, cy) < 0.0 and depth > slack
                drop = max(error[a], error[b]) + (inf if kept else depth)
                _, _, depth = _prolong(points, a, b, c, following[c])
                prolong = max(error[a], error[b] + depth, error[c])
                cost[b], step[b] = (drop, DROP) if drop <= prolong else (prolong, PROLONG)
                if min(drop, prolong) > tolerance:
                    cost[b], step[b] = inf, 0
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


# Tidy cells: the way through a safe region without bays, cusps, slivers and idle vertices.

GUARD = 1e-6
"""A tidy cell keeps this distance from the safe region's boundary, so that rounding never leaves it [m]."""

STANDING_OUT = 1e-7
"""How far vertices may stand out of the rest when they are left out, well within the guard [m]."""

DEEPEST_CUT = 0.02
"""Simplification never cuts deeper than this [m]."""

CUT_PER_CLEARANCE = 0.2
"""Simplification never cuts deeper than this fraction of the passage's clearance, either [-]."""

MITRE_LIMIT = 1.9
"""Longest mitre over the radius [-]: corners sharper than about 63 degrees are cut off. Below 2, so that a
passage between two opposite corners stays open."""

CORRIDOR = 2.0
"""The corridor is this many clearances wide to either side of the passage [-]."""

STRIDE, MOST_STRIDES = 0.5, 100
"""Discs of the corridor follow one another by this part of the passage's clearance [-], but there are not
more than about this many."""

SLIT = 0.2
"""Width of a slit over the passage's clearance [-]: the sides of a narrower one nearly coincide."""


def tidy_cell(safe: Polygon, points: Sequence[FloatArray]) -> Polygon:
    """Make a cell Q that can be mapped of a safe region S: opening(S, b/2), cut to a corridor, simplified.

    b is the clearance of the widest passage through the given points. The opening and the corridor keep the
    passage's clearance, and simplification takes off at most a fifth of it. The corridor leaves out bays that
    the passage goes by: a field that is harmonic in it follows the passage more closely. Holes are cut open
    by slits away from the passage, for without holes a field stands still nowhere. The opening as a whole is
    taken where it has fewer vertices and no more holes, and S itself where rounding spoils both.

    Args:
        safe: S, with holes or without [m].
        points: Points that Q must hold, in the order in which they are passed: entry, target; each (2,) [m].

    Returns:
        Q, inside S (checked exactly).

    Raises:
        GeometryError: If S does not join the points.
    """
    region = component_at(safe.buffer(-GUARD, join_style="mitre"), Point(points[0]))
    if region.is_empty:
        raise GeometryError(f"the safe region holds no path through {Point(points[0]).wkt}")
    finder = PassageFinder(region)
    passages = [finder.find(start, end) for start, end in pairwise(points)]
    path = LineString([point for passage in passages for point in passage.path.coords])
    clearance = min(passage.clearance for passage in passages)
    ends = [Point(point) for point in points]

    def serves(cell: Polygon) -> bool:
        inside = not cell.is_empty and cell.is_valid and safe.covers(cell)
        return inside and all(map(cell.contains, ends)) and bool(cell.covers(path))

    found = filter(serves, _tidied(region, path, clearance))
    simplest = lambda cell: (len(cell.interiors), shapely.get_num_coordinates(cell))  # noqa: E731
    return min(found, key=simplest, default=region)


def _tidied(region: Polygon, path: LineString, clearance: float) -> Iterator[Polygon]:
    """The opening of a region around a path, and the part of it in the corridor, both simplified."""
    start, depth = Point(path.coords[0]), max(min(DEEPEST_CUT, CUT_PER_CLEARANCE * clearance), STANDING_OUT)
    eroded = region.buffer(-0.5 * clearance, join_style="mitre", mitre_limit=MITRE_LIMIT)
    dilated = eroded.buffer(0.5 * clearance, join_style="mitre", mitre_limit=MITRE_LIMIT)
    # GEOS may give a mitred boundary that crosses itself, which it then refuses to intersect.
    opened = component_at(shapely.make_valid(dilated).intersection(region), start)
    stride = max(STRIDE * clearance, path.length / MOST_STRIDES)
    places = shapely.get_coordinates(shapely.segmentize(path, stride) if path.length > 0.0 else path)
    room = BoundaryDistance(region).batch(places)
    discs = shapely.buffer(shapely.points(places), CORRIDOR * room, quad_segs=4)
    links = shapely.convex_hull([shapely.MultiPolygon([*pair]) for pair in pairwise(discs)])
    for shape in (opened, component_at(shapely.union_all(links).intersection(opened), start)):
        if not shape.is_empty:
            # What the opening leaves out in the middle of a region without holes is safe all the same.
            whole = _cut_open(shape, path, clearance) if region.interiors else Polygon(shape.exterior)
            yield simplify_inward(whole, depth, STANDING_OUT)


def _cut_open(shape: Polygon, path: LineString, clearance: float) -> Polygon:
    """The part of a shape around a path, with slits from all holes away from the path to the outer ring."""
    half, slits = 0.5 * SLIT * clearance, []
    for hole in shape.interiors:
        near, end = shapely.get_coordinates(shapely.shortest_line(path, hole))
        away = (end - near) / np.hypot(*(end - near))
        ray = LineString([end, end + extent_of(shape) * away])
        length = half + Point(end).distance(ray.intersection(shape.exterior))
        slits.append(LineString([end - half * away, end + length * away]).buffer(half, cap_style="flat"))
    return component_at(shape.difference(shapely.union_all(slits)), Point(path.coords[0]))
