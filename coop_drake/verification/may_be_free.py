"""Where a team may be free at all in a slice: what inner sweeps leave of the floor, never too little."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.inner_sweeps import HAIR, inner_sweep
from coop_drake.verification.solids import colliding_pairs, team_solids
from coop_drake.verification.walls import Walls, wall_edges, wall_sums

__all__ = ["FreePositions", "fitting_positions", "without_slivers"]


class FreePositions:
    """Over-approximations for one team on one floor, cached by the intervals that move a solid.

    Args:
        tree: The team.
        robots: Robots that are kept.
        floor: The floor W.
    """

    def __init__(self, tree: ComponentTree, robots: tuple[int, ...], floor: Polygon) -> None:
        self.solids = team_solids(tree, robots)
        self._pairs = colliding_pairs(tree, self.solids)
        self._walls = wall_edges(floor)
        self._everywhere = box(*floor.bounds).buffer(tree.reach + 1.0, join_style="mitre")
        self._carried: dict[tuple[float, ...], BaseGeometry] = {}
        self._rings: dict[tuple[object, ...], FloatArray | None] = {}

    def outside(
        self, cover: BaseGeometry, lower: FloatArray, upper: FloatArray, tolerance: float
    ) -> BaseGeometry:
        """Positions outside a cover at which no wall is known to be touched all over a slice.

        Args:
            cover: Positions not asked about.
            lower: Lower ends of (theta, q...), those of joints that are not kept unused, shape (1 + n,).
            upper: Upper ends, shape (1 + n,).
            tolerance: How much sharper the sweeps could be [m].
        """
        rest = _areas(self._object_fits(lower, upper, tolerance).difference(cover))
        for index, solid in enumerate(self.solids):
            if rest.is_empty:
                break
            ring = self._ring(index, lower, upper, tolerance) if solid.component > 0 else None
            if ring is not None:
                rest = fitting_positions(self._walls, ring, rest)
        return without_slivers(rest, cover, HAIR)

    def fits_nowhere(self, lower: FloatArray, upper: FloatArray, place: FloatArray, tolerance: float) -> bool:
        """Whether the team collides at a position and all angles of a slice.

        Args:
            lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
            upper: Upper ends, shape (1 + n,).
            place: The position p_WL, shape (2,) [m].
            tolerance: How much sharper the sweeps could be [m].
        """
        for index in range(len(self.solids)):
            ring = self._ring(index, lower, upper, tolerance)
            if ring is not None and not self._walls.floor.covers(Polygon(ring + place)):
                return True
        return self.entangled(lower, upper, tolerance)

    def entangled(self, lower: FloatArray, upper: FloatArray, tolerance: float) -> bool:
        """Whether two bodies overlap at all angles of a slice; arguments as above."""
        for first, second, *counts in self._pairs:
            one, other = (
                inner_sweep(solid, lower, upper, tolerance, count)
                for solid, count in zip((first, second), counts, strict=True)
            )
            if one is not None and other is not None and _overlap(one, other):
                return True
        return False

    def _object_fits(self, lower: FloatArray, upper: FloatArray, tolerance: float) -> BaseGeometry:
        """Positions at which the object and what is welded to it may fit; the slices share them."""
        key = (float(lower[0]), float(upper[0]), tolerance)
        fits = self._carried.get(key)
        if fits is None:
            fits = self._everywhere
            for index, solid in enumerate(self.solids):
                ring = self._ring(index, lower, upper, tolerance) if solid.component == 0 else None
                if ring is not None:
                    fits = fitting_positions(self._walls, ring, fits)
            self._carried[key] = fits
        return fits

    def _ring(self, index: int, lower: FloatArray, upper: FloatArray, tolerance: float) -> FloatArray | None:
        """Inner sweep of a solid, None where it has no area."""
        axes = [stage.axis for stage in self.solids[index].stages]
        key = (index, tolerance, *lower[axes].tolist(), *upper[axes].tolist())
        if key not in self._rings:
            self._rings[key] = _with_area(inner_sweep(self.solids[index], lower, upper, tolerance))
        return self._rings[key]


def fitting_positions(walls: Walls, ring: FloatArray, among: BaseGeometry) -> MultiPolygon:
    """Positions p at which a convex footprint stays inside the floor: (W - f) minus all e + (-F).

    Args:
        walls: The floor and its edges.
        ring: Vertices of the footprint F relative to p, with area, shape (m, 2) [m].
        among: Positions to choose from.
    """
    fits = _areas(among.intersection(affinity.translate(walls.floor, -ring[0, 0], -ring[0, 1])))
    if fits.is_empty:
        return fits
    near = walls.near(np.array(fits.bounds) + np.concatenate((ring.min(axis=0), ring.max(axis=0))))
    sums = wall_sums(walls.starts[near], walls.ends[near], ring)
    shapely.prepare(fits)
    return _areas(fits.difference(shapely.union_all(sums[shapely.intersects(fits, sums)])))


def without_slivers(rest: BaseGeometry, cover: BaseGeometry, hair: float) -> MultiPolygon:
    """What is left without parts that are rounding: they hold no disc of a quarter of the hair.

    A footprint that is smaller than it need be by a hair fits all over the disc of that radius about every
    free position. Only beside the cover, which may cut such discs, every part counts.

    Args:
        rest: Positions outside a cover at which a footprint fits that is a hair smaller than it need be.
        cover: The cover.
        hair: The hair [m].
    """
    parts = np.asarray(shapely.get_parts(_areas(rest)))
    thick = ~shapely.is_empty(shapely.buffer(parts, -0.25 * hair))
    beside = shapely.distance(parts, cover) <= 2.0 * hair
    return MultiPolygon(list(parts[thick | beside]))


def _areas(shape: BaseGeometry) -> MultiPolygon:
    """The polygons of a shape: sweeps lie a hair inside, so that lines hold no free position."""
    return MultiPolygon([part for part in shapely.get_parts(shape) if isinstance(part, Polygon)])


def _with_area(ring: FloatArray | None) -> FloatArray | None:
    return None if ring is None or len(ring) < 3 or Polygon(ring).area <= 0.0 else ring


def _overlap(first: FloatArray, second: FloatArray) -> bool:
    """Whether the interiors of two convex polygons meet."""
    if min(len(first), len(second)) < 3:
        return False
    return bool(shapely.relate_pattern(Polygon(first), Polygon(second), "T********"))
