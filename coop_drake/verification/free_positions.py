"""Over-approximation of the positions at which a team may be free somewhere in a slice.

An inner sweep of a body is a polygon that the body covers at every angle of the slice. At positions where
this polygon meets a wall the team is therefore in collision at every angle of the slice; all others may be
free.
"""

from __future__ import annotations

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.floor_edges import FloorEdges, edge_obstacles, floor_edges
from coop_drake.verification.inner_sweeps import INSET, inner_sweep
from coop_drake.verification.solids import colliding_pairs, team_solids

__all__ = ["FreePositions", "fitting_positions", "without_slivers"]

BEYOND = 1.0
"""The floor is framed by this and the team's reach: further out nothing is free [m]."""


class FreePositions:
    """Over-approximations for one team on one floor; sweeps are kept for slices that share their intervals.

    Args:
        tree: The team.
        robots: Robots that are kept.
        floor: The floor W.
    """

    def __init__(self, tree: ComponentTree, robots: tuple[int, ...], floor: Polygon) -> None:
        self.solids = team_solids(tree, robots)
        self._pairs = colliding_pairs(tree, self.solids)
        self._edges = floor_edges(floor)
        self._everywhere = box(*floor.bounds).buffer(tree.reach + BEYOND, join_style="mitre")
        self._carried: dict[tuple[float, ...], BaseGeometry] = {}
        self._rings: dict[tuple[object, ...], FloatArray | None] = {}

    def outside(
        self, cover: BaseGeometry, lower: FloatArray, upper: FloatArray, tolerance: float
    ) -> BaseGeometry:
        """Positions outside a cover that are not proved blocked by a wall.

        A position is proved blocked if one body meets a wall there at every angle of the slice.

        Args:
            cover: Positions that are left out.
            lower: Lower ends of (theta, q...), those of joints that are not kept unused, shape (1 + n,).
            upper: Upper ends, shape (1 + n,).
            tolerance: How much the inner sweeps may leave out [m].
        """
        rest = _areas(self._object_fits(lower, upper, tolerance).difference(cover))
        for index, solid in enumerate(self.solids):
            if rest.is_empty:
                break
            ring = self._ring(index, lower, upper, tolerance) if solid.component > 0 else None
            if ring is not None:
                rest = fitting_positions(self._edges, ring, rest)
        return without_slivers(rest, cover, INSET)

    def collides_at(self, lower: FloatArray, upper: FloatArray, place: FloatArray, tolerance: float) -> bool:
        """Whether the team is known to be in collision at a position p_WL (2,) [m]; arguments as above."""
        for index in range(len(self.solids)):
            ring = self._ring(index, lower, upper, tolerance)
            if ring is not None and not self._edges.floor.covers(Polygon(ring + place)):
                return True
        return self.bodies_overlap(lower, upper, tolerance)

    def bodies_overlap(self, lower: FloatArray, upper: FloatArray, tolerance: float) -> bool:
        """Whether one pair of bodies is known to overlap at all angles of a slice; arguments as above."""
        for first, second, *counts in self._pairs:
            one, other = (
                inner_sweep(solid, lower, upper, tolerance, count)
                for solid, count in zip((first, second), counts, strict=True)
            )
            if one is not None and other is not None and _overlap(one, other):
                return True
        return False

    def _object_fits(self, lower: FloatArray, upper: FloatArray, tolerance: float) -> BaseGeometry:
        """Positions at which the object with what is welded to it may fit: they depend on theta alone."""
        key = (float(lower[0]), float(upper[0]), tolerance)
        fits = self._carried.get(key)
        if fits is None:
            fits = self._everywhere
            for index, solid in enumerate(self.solids):
                ring = self._ring(index, lower, upper, tolerance) if solid.component == 0 else None
                if ring is not None:
                    fits = fitting_positions(self._edges, ring, fits)
            self._carried[key] = fits
        return fits

    def _ring(self, index: int, lower: FloatArray, upper: FloatArray, tolerance: float) -> FloatArray | None:
        """Inner sweep of a solid, None where it has no area."""
        axes = [stage.axis for stage in self.solids[index].stages]
        key = (index, tolerance, *lower[axes].tolist(), *upper[axes].tolist())
        if key not in self._rings:
            ring = inner_sweep(self.solids[index], lower, upper, tolerance)
            flat = ring is None or len(ring) < 3 or Polygon(ring).area <= 0.0
            self._rings[key] = None if flat else ring
        return self._rings[key]


def fitting_positions(edges: FloorEdges, ring: FloatArray, among: BaseGeometry) -> MultiPolygon:
    """Positions at which a convex footprint F lies inside the floor W.

    A position p is one of these if p + f is in W for one point f of F and p + F meets no edge of W: the set
    (W - f) without the obstacles e + (-F) of all edges e.

    Args:
        edges: The floor and its edges.
        ring: Vertices of F relative to p, with area, shape (m, 2) [m].
        among: Positions to choose from.
    """
    fits = _areas(among.intersection(affinity.translate(edges.floor, -ring[0, 0], -ring[0, 1])))
    if fits.is_empty:
        return fits
    near = edges.near(np.array(fits.bounds) + np.concatenate((ring.min(axis=0), ring.max(axis=0))))
    obstacles = edge_obstacles(edges.starts[near], edges.ends[near], ring)
    shapely.prepare(fits)
    return _areas(fits.difference(shapely.union_all(obstacles[shapely.intersects(fits, obstacles)])))


def without_slivers(rest: BaseGeometry, cover: BaseGeometry, inset: float) -> MultiPolygon:
    """Leave out parts that only rounding left: those that hold no disc of a quarter of the inset.

    About every free position a footprint that was made smaller by the inset fits at all positions of a disc
    with that radius. Only parts beside the cover, which may cut such discs, all count.

    Args:
        rest: Positions outside a cover at which such a smaller footprint fits.
        cover: The cover.
        inset: By how much the footprint is smaller [m].
    """
    parts = np.asarray(shapely.get_parts(_areas(rest)))
    thick = ~shapely.is_empty(shapely.buffer(parts, -0.25 * inset))
    beside = shapely.distance(parts, cover) <= 2.0 * inset
    return MultiPolygon(list(parts[thick | beside]))


def _areas(shape: BaseGeometry) -> MultiPolygon:
    """The polygons of a shape: as sweeps are a little too small, no free position lies on a line alone."""
    return MultiPolygon([part for part in shapely.get_parts(shape) if isinstance(part, Polygon)])


def _overlap(first: FloatArray, second: FloatArray) -> bool:
    """Whether the interiors of two convex polygons meet."""
    if min(len(first), len(second)) < 3:
        return False
    return bool(shapely.relate_pattern(Polygon(first), Polygon(second), "T********"))
