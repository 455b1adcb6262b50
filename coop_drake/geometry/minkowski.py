"""Positions at which a convex footprint fits into the workspace: the Minkowski difference of eq. (9)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import cos, radians, sin

import numpy as np
import shapely
from manifold3d import CrossSection, FillRule, OpType
from shapely import MultiPolygon, Polygon
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry

from coop_drake.geometry.polygons import polygon_rings
from coop_drake.geometry.sweeps import following, shrunk
from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray, IntArray

# Replacements for results of geometry libraries that fail; they never prove a position free or blocked.

_FAILURES = (RuntimeError, ValueError, ArithmeticError)
_ROUNDING = 1e-6
"""Areas that should be equal may differ by this fraction [-]: more than rounding, less than a failure."""


def shared(first: CrossSection, second: CrossSection, *, over: bool) -> CrossSection:
    """Intersection of two regions; where clipping fails, the smaller over-region or the empty under-region.

    Of an over-region what is left out is called blocked, of another one what is kept is called free.
    """
    smaller = min(first, second, key=CrossSection.area)
    try:
        found = common(first, second)
        if found.area() <= (1.0 + _ROUNDING) * smaller.area():
            return found
    except _FAILURES:
        pass
    return smaller if over else CrossSection()


def components(section: CrossSection, *, over: bool) -> list[CrossSection]:
    """Connected parts of a region; if decomposing fails, the whole region if ``over``, otherwise none."""
    if section.is_empty():
        return []
    try:
        parts = [part for part in section.decompose() if not part.is_empty()]
        if abs(sum(part.area() for part in parts) - section.area()) <= _ROUNDING * section.area():
            return parts
    except _FAILURES:
        pass
    return [section] if over else []


def meet(first: CrossSection, second: CrossSection, *, otherwise: bool) -> bool:
    """Whether two regions share more than their boundary; ``otherwise`` where clipping fails."""
    try:
        return not common(first, second).is_empty()
    except _FAILURES:
        return otherwise


def checked_buffer(workspace: Polygon | MultiPolygon, distance: float) -> Polygon | MultiPolygon:
    """W, grown or shrunk where the distance is negative [m]; if that fails, its bounding box, or nothing."""
    try:
        result = workspace.buffer(distance, join_style="mitre")
        nested = result.covers(workspace) if distance > 0.0 else workspace.covers(result)
    except ShapelyError:
        nested = False
    if nested and isinstance(result, Polygon | MultiPolygon):
        return result
    if distance < 0.0 or workspace.is_empty:
        return Polygon()
    x_min, y_min, x_max, y_max = workspace.bounds
    return shapely.box(x_min - distance, y_min - distance, x_max + distance, y_max + distance)


def second_opinion(rings: Sequence[FloatArray], edges: FloatArray, footprint: FloatArray) -> list[FloatArray]:
    """Positions p with p + F inside a floor by GEOS, or a box around all of them where GEOS fails, too.

    Args:
        rings: The floor's rings, shape (n, 2) each [m].
        edges: All their edges, shape (E, 2, 2) [m].
        footprint: Convex polygon F relative to p, shape (n, 2) [m].

    Returns:
        Rings, outer ones counter-clockwise, holes clockwise.
    """
    if not rings:
        return []
    start = footprint[0]
    try:
        floor: BaseGeometry = Polygon()
        for ring in rings:
            floor = shapely.symmetric_difference(floor, Polygon(ring))
        sums = (edges[:, :, None, :] - footprint).reshape(len(edges), -1, 2)
        walls = shapely.union_all(shapely.convex_hull(shapely.linestrings(sums)))
        return polygon_rings(shapely.transform(floor, lambda points: points - start).difference(walls))
    except (ShapelyError, ValueError):
        corners = edges.reshape(-1, 2) - start
        return polygon_rings(shapely.box(*corners.min(axis=0), *corners.max(axis=0)))


# The Minkowski difference of eq. (9) and intersections on floors with very many corners.
#
# The clipping library sweeps a line over the plane and looks for the place of every corner among all edges
# that the line meets, one by one: where a horizontal wall has tens of thousands of corners, the time grows
# with their square. Here the plane is turned first, so that walls that are parallel to the axes, as most
# long ones are, meet the line in few places.

LARGE = 10_000
"""Number of corners from which on the plane is turned [-]: below, it saves less than a tenth of a second."""

_PLANE_TURN = 29.3
"""How far the plane is turned [degrees]: away from all multiples of 15, at which walls are likely."""

_EDGES, _PARTS = 8, 4
"""How many edges are united at once at first, and how many unions of neighbours later: few overlap."""


def common(first: CrossSection, second: CrossSection) -> CrossSection:
    """Intersection of two regions."""
    if first.num_vert() + second.num_vert() < LARGE:
        return first ^ second
    return (first.rotate(_PLANE_TURN) ^ second.rotate(_PLANE_TURN)).rotate(-_PLANE_TURN)


def fitting_on_large_floor(
    rings: Sequence[FloatArray], edges: FloatArray, footprint: FloatArray
) -> CrossSection:
    """Positions p with p + F inside a floor: where F's first vertex is inside and F meets no wall.

    Neighbouring edges are united first: their sums with -F overlap so much that all at once would cross in as
    many places as there are pairs of edges within a footprint.

    Args:
        rings: The floor's rings, outer ones counter-clockwise, holes clockwise, shape (n, 2) each [m].
        edges: All their edges (x0, y0, x1, y1) in order, shape (E, 4) [m].
        footprint: Convex ring F, shape (n, 2) [m].
    """
    sums = _turned(edges.reshape(-1, 2, 1, 2) - footprint).reshape(len(edges), -1, 2)
    corners, owner = shapely.get_coordinates(
        shapely.convex_hull(shapely.linestrings(sums)), return_index=True
    )
    bounds = [0, *(np.flatnonzero(np.diff(owner)) + 1).tolist(), len(corners)]
    hulls = [corners[a : b - 1] for a, b in pairwise(bounds)]
    walls = [CrossSection(hulls[k : k + _EDGES], FillRule.NonZero) for k in range(0, len(hulls), _EDGES)]
    while len(walls) > 1:
        walls = [
            CrossSection.batch_boolean(walls[k : k + _PARTS], OpType.Add)
            for k in range(0, len(walls), _PARTS)
        ]
    floor = CrossSection([_turned(ring - footprint[0]) for ring in rings], FillRule.Positive)
    return (floor - walls[0]).rotate(-_PLANE_TURN)


def _turned(points: FloatArray) -> FloatArray:
    """Points, shape (..., 2), in the turned plane."""
    c, s = cos(radians(_PLANE_TURN)), sin(radians(_PLANE_TURN))
    turned: FloatArray = points @ np.array([[c, s], [-s, c]])
    return turned


# Compiled cycles that wind once around the positions at which a convex footprint fits between walls.

_NEEDLE = 1e-12
"""A corner whose edges turn back with a smaller sine than this is a needle [-]: rounding decides its side."""


@compiled
def fitting_cycles(
    points: FloatArray, first: IntArray, extents: FloatArray, convex: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Trace every ring with the footprint's vertex that lies furthest out: the reduced convolution with -F.

    Along an edge the vertex v furthest beyond it draws the edge, shifted by -v. Where the floor is not
    convex the vertices in between follow one by one, clockwise; where it is convex the ends are joined, for
    whatever else the full convolution would draw there lies where the corner is inside the footprint.

    Args:
        points: Vertices of all rings, outer ones counter-clockwise, holes clockwise, none twice in a row,
            shape (E, 2) [m].
        first: Where each ring begins, shape (R + 1,).
        extents: Widths in x and y of what a ring encloses, shape (R, 2); a ring no wider and no higher than F
            is left out [m].
        convex: Convex ring F, counter-clockwise, shape (n, 2) [m].

    Returns:
        Vertices of the cycles, shape (V, 2) [m], and where each begins, shape (R + 1,); none of small rings.
    """
    # Beyond each edge this vertex of the footprint lies furthest out.
    furthest = np.zeros(len(points), np.int64)
    for r in range(len(first) - 1):
        for i in range(first[r], first[r + 1]):
            after = i + 1 if i + 1 < first[r + 1] else first[r]
            x, y = points[after, 1] - points[i, 1], points[i, 0] - points[after, 0]
            most = -np.inf
            for k in range(len(convex)):
                out = x * convex[k, 0] + y * convex[k, 1]
                if out > most:
                    most, furthest[i] = out, k
    starts = np.zeros(len(first), np.int64)
    drawn = np.empty((0, 2))
    width, height = np.ptp(convex[:, 0]), np.ptp(convex[:, 1])
    for writing in range(2):
        size = 0
        for r in range(len(first) - 1):
            before = first[r + 1] - 1
            small = extents[r, 0] <= width and extents[r, 1] <= height
            for i in range(first[r], first[r] if small else first[r + 1]):
                after = i + 1 if i + 1 < first[r + 1] else first[r]
                k, last = furthest[before], furthest[i]
                ax, ay = points[i, 0] - points[before, 0], points[i, 1] - points[before, 1]
                bx, by = points[after, 0] - points[i, 0], points[after, 1] - points[i, 1]
                cross, dot = ax * by - ay * bx, ax * bx + ay * by
                # The corner points into the floor, or it is a needle, which blocks no more.
                turn = cross <= 0.0 or (dot < 0.0 and cross <= -_NEEDLE * dot)
                while True:
                    if writing == 1:
                        drawn[size, 0] = points[i, 0] - convex[k, 0]
                        drawn[size, 1] = points[i, 1] - convex[k, 1]
                    size += 1
                    if k == last:
                        break
                    k = (k if k > 0 else len(convex)) - 1 if turn else last
                before = i
            starts[r + 1] = size
        if writing == 0:
            drawn = np.empty((size, 2))
    return drawn, starts


SAFE_SIDE = 1e-6
"""How far a workspace or a footprint is shrunk once [m]: a hundred times the clipping library's grid."""


class FreeSpace:
    """A workspace that footprints are subtracted from; it may be non-convex and may have holes.

    The convolution of W's boundary with -F winds once around p where p + F lies inside W, and otherwise
    1 - n times, n the number of pieces of p + F beyond the walls: positions with a positive winding number
    are those of the difference. Only a part of W that lies inside p + F would count as free, so parts that
    are smaller than F are left out. One clipping pass does all, but on floors with very many corners.

    Where the clipping library fails, the result is on the safe side: an under-space is replaced by the empty
    set, an over-space by another library's result or by a box that holds every position.

    Args:
        rings: Outer rings counter-clockwise, holes clockwise, each of shape (n, 2) [m].
        over: Whether positions that are left out are called blocked; else those that are kept, free.
        grown: The grown workspace, if footprints are to be shrunk instead of growing it, but for thin ones.

    Attributes:
        edges: Its edges (x0, y0, x1, y1), shape (E, 4) [m].
    """

    def __init__(
        self, rings: Sequence[FloatArray], *, over: bool = False, grown: FreeSpace | None = None
    ) -> None:
        self.rings, self._over, self._grown = tuple(map(_without_repeats, rings)), over, grown
        tails = [following(ring) for ring in self.rings]
        starts = np.concatenate(self.rings) if self.rings else np.empty((0, 2))
        ends = np.concatenate(tails) if tails else np.empty((0, 2))
        self.edges = np.hstack((starts, ends))
        self._lower = starts.min(axis=0, initial=np.inf)
        self._upper = starts.max(axis=0, initial=-np.inf)
        self._points = np.ascontiguousarray(starts, dtype=float)
        self._first = np.cumsum([0, *map(len, self.rings)])
        areas = [_area(ring) for ring in self.rings]
        extents = [
            np.ptp(ring, axis=0) if area > 0.0 else (np.inf, np.inf)
            for ring, area in zip(self.rings, areas, strict=True)
        ]
        self._extents = np.array(extents, dtype=float).reshape(-1, 2)
        self._most_area = sum(areas) + SAFE_SIDE * float(np.hypot(*(ends - starts).T).sum())

    @classmethod
    def under(cls, workspace: Polygon | MultiPolygon) -> FreeSpace:
        """The workspace shrunk by ``SAFE_SIDE``, so that rounding never leaves it."""
        return cls(polygon_rings(checked_buffer(workspace, -SAFE_SIDE)))

    @classmethod
    def over(cls, workspace: Polygon | MultiPolygon) -> FreeSpace:
        """The workspace, and footprints shrunk by ``SAFE_SIDE``, so that rounding never loses a position.

        Walls are not thinned, because a hair-thin wall would vanish. Only footprints too thin to be shrunk
        are subtracted from a grown workspace, and so is every one if a ring crosses itself.
        """
        grown, rings = (
            cls(polygon_rings(checked_buffer(workspace, SAFE_SIDE)), over=True),
            polygon_rings(workspace),
        )
        return cls(rings, over=True, grown=grown) if all(Polygon(ring).is_valid for ring in rings) else grown

    def minus(self, footprint: FloatArray) -> CrossSection:
        """Positions p with p + F inside the workspace; F is convex, counter-clockwise, shape (n, 2) [m]."""
        if self._grown is not None:
            smaller = shrunk(footprint, SAFE_SIDE)
            if len(smaller) == 0:
                return self._grown.minus(footprint)
            footprint = smaller
        try:
            found: CrossSection | None = self._clipped(footprint)
        except (RuntimeError, ValueError):
            found = None
        if found is not None and self._plausible(found, footprint[0]):
            return found
        if not self._over:
            return CrossSection()
        return CrossSection(
            second_opinion(self.rings, self.edges.reshape(-1, 2, 2), footprint), FillRule.Positive
        )

    def _clipped(self, footprint: FloatArray) -> CrossSection:
        if len(self.edges) >= LARGE:
            return fitting_on_large_floor(self.rings, self.edges, footprint)
        convex = np.ascontiguousarray(footprint, dtype=float)
        drawn, first = fitting_cycles(self._points, self._first, self._extents, convex)
        places = first.tolist()
        cycles = [drawn[a:b] for a, b in pairwise(places) if a < b]
        return CrossSection(cycles, FillRule.Positive)

    def _plausible(self, found: CrossSection, start: FloatArray) -> bool:
        """Whether a difference lies where it must; one that blocks every position is checked by GEOS."""
        if found.is_empty():
            return not self._over
        x_min, y_min, x_max, y_max = found.bounds()
        lower, upper = self._lower - start, self._upper - start
        beyond = max(lower[0] - x_min, lower[1] - y_min, x_max - upper[0], y_max - upper[1])
        return bool(beyond <= SAFE_SIDE and 0.0 <= found.area() <= self._most_area)


def _without_repeats(ring: FloatArray) -> FloatArray:
    """The ring without vertices that repeat the one before."""
    distinct: FloatArray = np.asarray(ring, dtype=float)[(ring != following(ring)).any(axis=1)]
    return distinct


def _area(ring: FloatArray) -> float:
    """Area that a ring encloses, negative where it runs clockwise [m^2]."""
    points = ring - ring[:1]
    tail = following(points)
    return 0.5 * float((points[:, 0] * tail[:, 1] - points[:, 1] * tail[:, 0]).sum())


def to_polygon(component: CrossSection) -> Polygon:
    """One connected region, with any number of holes, as a shapely polygon."""
    rings = [np.asarray(ring, dtype=float) for ring in component.to_polygons()]
    outer = max(range(len(rings)), key=lambda i: float(np.ptp(rings[i][:, 0]) * np.ptp(rings[i][:, 1])))
    return Polygon(rings[outer], [ring for i, ring in enumerate(rings) if i != outer])
