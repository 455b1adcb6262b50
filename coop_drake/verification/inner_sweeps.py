"""Inner sweeps: convex polygons that a solid covers at every configuration of a slice.

They are found by cutting planes, and correct because each of their vertices is checked in the end.
"""

from __future__ import annotations

from math import ceil, pi, sqrt

import numpy as np
from shapely import Polygon

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.outer_sweeps import hull_vertices, outer_sweep, turned
from coop_drake.verification.solids import Solid, Stage

__all__ = ["inner_sweep", "inscribed_circle"]

INSET = 1e-8
"""Inner sweeps stay this far inside, which is far more than rounding [m]."""

ROUNDS = 60
"""Rounds of cutting after which a sweep counts as empty, which is always correct [-]."""


def inner_sweep(
    solid: Solid, lower: FloatArray, upper: FloatArray, tolerance: float, stages: int | None = None
) -> FloatArray | None:
    """Find a convex polygon that a solid covers at every configuration of a slice.

    Args:
        solid: The solid.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        tolerance: How far the polygon may stay inside the region that is covered, about [m].
        stages: How many stages to sweep, as in ``outer_sweep``.

    Returns:
        Vertices, counter-clockwise, shape (m, 2) [m], or None where nothing was found.
    """
    moving = solid.stages[:stages]
    part = tolerance / (len(moving) + 1)  # One part for every stage and one for the rounding by the radius.
    if len(solid.vertices) == 1:
        centres = outer_sweep(solid, lower, upper, part, stages)
        return _common_to_discs(centres, solid.radius - INSET, part)
    ring: FloatArray | None = solid.vertices if solid.radius == 0.0 else _rounded(solid, part)
    for stage in moving:
        if ring is None or Polygon(ring).area <= INSET**2:
            return None
        ring = _kept(ring, stage, lower[stage.axis], upper[stage.axis], part)
        ring = None if ring is None else hull_vertices(stage.X_PJ.apply(ring))
    return ring


def _kept(ring: FloatArray, stage: Stage, first: float, last: float, tolerance: float) -> FloatArray | None:
    """Points that a convex ring covers at all values of one joint."""
    first, last = sorted((stage.scale * first, stage.scale * last))
    normals, offsets = _half_planes(ring)
    if stage.kind == "prismatic":
        kept: FloatArray | None = ring + first * stage.direction
        slides = normals @ stage.direction
        for normal, offset in zip(normals, offsets + np.minimum(first * slides, last * slides), strict=True):
            kept = None if kept is None else _cut(kept, normal, offset - INSET)
        return kept
    return _common_to_turns(normals, offsets - INSET, ring, (first, last), tolerance)


def _common_to_turns(
    normals: FloatArray, offsets: FloatArray, ring: FloatArray, turn: tuple[float, float], tolerance: float
) -> FloatArray | None:
    """Points x that lie in a ring turned by any angle t of an interval.

    Each edge of the ring, whose outward normal has the bearing a, demands n(a + t) . x <= h for all t. The
    left side is largest where a + t is nearest to the bearing of x: this gives the maximum in closed
    form. As the set of such x is convex, a polygon lies in it if its vertices do. A vertex that does not is
    cut off along the half-plane that it violates most, deeper by the tolerance, so that few rounds are
    enough.
    """
    bearings = np.arctan2(normals[:, 1], normals[:, 0])
    middle, half = 0.5 * (turn[0] + turn[1]), 0.5 * (turn[1] - turn[0])
    kept: FloatArray | None = turned(ring, np.array([turn[0]]))
    for _ in range(ROUNDS):
        if kept is None:
            return None
        radius, bearing = np.hypot(*kept.T), np.arctan2(kept[:, 1], kept[:, 0])
        off = bearing[:, None] - bearings - middle
        off -= 2.0 * pi * np.rint(off / (2.0 * pi))
        beyond = np.maximum(np.abs(off) - half, 0.0)
        excess = radius[:, None] * np.cos(beyond) - offsets
        worst = np.argmax(excess, axis=1)
        rows = np.flatnonzero(excess.max(axis=1) > 0.0)
        if not len(rows):
            return kept
        angles = bearings[worst] + middle + np.clip(off[np.arange(len(off)), worst], -half, half)
        for row in rows:
            if kept is not None:
                normal = np.array([np.cos(angles[row]), np.sin(angles[row])])
                kept = _cut(kept, normal, offsets[worst[row]] - tolerance)
    return None


def _cut(ring: FloatArray, normal: FloatArray, offset: float) -> FloatArray | None:
    """The part of a convex ring with n . x <= offset, None where nothing or one corner is left."""
    height = ring @ normal - offset
    inside = height <= 0.0
    if inside.all():
        return ring
    first = np.flatnonzero(inside & ~np.concatenate((inside[-1:], inside[:-1])))
    if not len(first):
        return None
    order = (np.arange(len(ring)) + first[0]) % len(ring)
    ring, height = ring[order], height[order]
    count = int(np.argmax(height > 0.0))
    ends = [(count - 1, count), (0, len(ring) - 1)]
    leave, enter = (ring[a] + (ring[b] - ring[a]) * height[a] / (height[a] - height[b]) for a, b in ends)
    return np.concatenate((ring[:count], [leave, enter]))


def _half_planes(ring: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Outward unit normals (n, 2) and offsets (n,) of a counter-clockwise ring's edges."""
    if Polygon(ring).exterior.is_ccw is False:
        ring = ring[::-1]
    sides = np.roll(ring, -1, axis=0) - ring
    lengths = np.hypot(*sides.T)
    ring, sides, lengths = (part[lengths > 0.0] for part in (ring, sides, lengths))
    normals = np.stack((sides[:, 1], -sides[:, 0]), axis=1) / lengths[:, None]
    return normals, np.einsum("ij,ij->i", normals, ring)


def inscribed_circle(radius: float, tolerance: float) -> FloatArray:
    """Vertices of a regular polygon inside a circle, no further from it than the tolerance, shape (k, 2)."""
    count = max(8, ceil(2.0 * pi / sqrt(8.0 * tolerance / max(radius, tolerance))))
    return radius * turned(np.array([[1.0, 0.0]]), 2.0 * pi * np.arange(count) / count)


def _rounded(solid: Solid, tolerance: float) -> FloatArray:
    """Polygon inside a solid that has a radius, with vertices where its arcs meet its straight sides."""
    radius, ring = solid.radius - INSET, solid.vertices
    arcs = ring[:, None, :] + inscribed_circle(radius, tolerance)
    sides = np.roll(ring, -1, axis=0) - ring
    outward = radius * np.stack((sides[:, 1], -sides[:, 0]), axis=1) / np.hypot(*sides.T)[:, None]
    corners = (ring + outward, np.roll(ring, -1, axis=0) + outward)
    return hull_vertices(np.concatenate((arcs.reshape(-1, 2), *corners)))


def _common_to_discs(centres: FloatArray, radius: float, tolerance: float) -> FloatArray | None:
    """Polygon inside all discs of one radius about the points of a convex polygon.

    A point is near enough to all points of a convex polygon if it is to the vertices. Candidates are the
    points where rays from the middle leave the first disc and where circles about neighbouring centres cross;
    those that lie in all discs are kept.
    """
    middle = 0.5 * (centres.min(axis=0) + centres.max(axis=0))
    away = middle - centres
    inside = radius**2 - np.einsum("ij,ij->i", away, away)
    if (inside <= 0.0).any():
        return None
    rays = inscribed_circle(1.0, tolerance / max(radius, tolerance))
    along = rays @ away.T
    reach = np.sqrt(along**2 + inside) - along
    nearest = np.argmin(reach, axis=1)
    after = np.roll(nearest, -1)
    crossings = _crossings(centres[nearest[nearest != after]], centres[after[nearest != after]], radius)
    candidates = np.concatenate((middle + rays * reach.min(axis=1)[:, None], crossings))
    distances = np.hypot(*(candidates[:, None, :] - centres).transpose(2, 0, 1)).max(axis=1)
    return hull_vertices(candidates[distances <= radius + 0.1 * INSET])


def _crossings(first: FloatArray, second: FloatArray, radius: float) -> FloatArray:
    """Both points in which the circles about two centres meet; shapes (k, 2) to (2 k, 2)."""
    across = second - first
    square = np.einsum("ij,ij->i", across, across)
    height = np.sqrt(np.maximum(radius**2 / square - 0.25, 0.0))[:, None]
    side = height * np.stack((-across[:, 1], across[:, 0]), axis=1)
    middle = 0.5 * (first + second)
    return np.concatenate((middle + side, middle - side))
