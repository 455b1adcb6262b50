"""Divides a polygon into few convex parts whose union is exactly the polygon."""

from __future__ import annotations

import numpy as np
from shapely import Polygon, constrained_delaunay_triangles

from coop_drake.tree.pose import FloatArray

Ring = list[tuple[float, float]]

_STRAIGHT = 1e-12
"""Cross product of two edges up to which a corner counts as straight [m^2]."""


def convex_parts(outline: Polygon) -> list[Polygon]:
    """Triangulate a valid polygon and merge neighbouring parts while they stay convex.

    The corners of the parts are corners of the outline, so their union is exact. The parts are
    counter-clockwise, in an order that depends on the outline alone.
    """
    triangles = constrained_delaunay_triangles(outline).geoms
    rings = sorted(_ring(t) for t in triangles if isinstance(t, Polygon) and t.area > 0.0)
    joined = True
    while joined:
        joined = False
        for first in range(len(rings)):
            for second in range(first + 1, len(rings)):
                merged = _merge(rings[first], rings[second])
                if merged is not None:
                    rings[first] = merged
                    del rings[second]
                    joined = True
                    break
            if joined:
                break
    return [Polygon(ring) for ring in rings]


def _ring(polygon: Polygon) -> Ring:
    """Counter-clockwise corners, the smallest (x, y) first."""
    corners = [(float(x), float(y)) for x, y in polygon.exterior.coords[:-1]]
    if not polygon.exterior.is_ccw:
        corners.reverse()
    start = corners.index(min(corners))
    return corners[start:] + corners[:start]


def _merge(first: Ring, second: Ring) -> Ring | None:
    """Merge two rings along a common edge; None if they have none or the result is not convex."""
    for index, start in enumerate(first):
        end = first[(index + 1) % len(first)]
        if end not in second:
            continue
        other = second.index(end)
        if second[(other + 1) % len(second)] == start:
            around = [second[(other + 1 + step) % len(second)] for step in range(len(second))]
            merged = first[: index + 1] + around[1:-1] + first[index + 1 :]
            return merged if _is_convex(np.array(merged)) else None
    return None


def _is_convex(ring: FloatArray) -> bool:
    edges = np.roll(ring, -1, axis=0) - ring
    following = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    return bool((turns >= -_STRAIGHT).all())
