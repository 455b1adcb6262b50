"""Positions at which a convex footprint fits into the workspace: the Minkowski difference of eq. (9)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, FillRule
from shapely import MultiPolygon, Polygon

from coop_drake.geometry.sweeps import shrunk
from coop_drake.geometry.sweeps import following
from coop_drake.geometry.minkowski import LARGE, fitting_on_large_floor
from coop_drake.geometry.polygons import polygon_rings
from coop_drake.geometry.minkowski import checked_buffer, second_opinion
from coop_drake.geometry.minkowski import fitting_cycles
from coop_drake.tree.pose import FloatArray

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
