"""What a solid covers at every configuration of a slice: cutting planes, checked vertex by vertex."""

from __future__ import annotations

from math import ceil, pi, sqrt

import numpy as np
from shapely import Polygon

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.outer_sweeps import hull_vertices, outer_sweep, turned
from coop_drake.verification.solids import Solid, Stage

__all__ = ["inner_sweep", "inscribed_circle"]

HAIR = 1e-8
"""Inner sweeps stay this far inside, so that rounding never carries them out [m]."""

ROUNDS = 60
"""Rounds of cutting after which a sweep counts as empty."""


def inner_sweep(
    solid: Solid, lower: FloatArray, upper: FloatArray, tolerance: float, stages: int | None = None
) -> FloatArray | None:
    """Find a convex polygon that a solid covers at every configuration of a slice.

    Args:
        solid: The solid.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        tolerance: About how much of what is covered may be left out [m].
        stages: How many joints to sweep, as in ``outer_sweep``.

    Returns:
        Vertices, counter-clockwise, shape (m, 2) [m], or None where nothing was found.
    """
    moving = solid.stages[:stages]
    share = tolerance / (len(moving) + 1)
    if len(solid.vertices) == 1:
        centres = outer_sweep(solid, lower, upper, share, stages)
        return _common_to_discs(centres, solid.radius - HAIR, share)
    ring: FloatArray | None = solid.vertices if solid.radius == 0.0 else _rounded(solid, share)
    for stage in moving:
        if ring is None or Polygon(ring).area <= HAIR**2:
            return None
        ring = _kept(ring, stage, lower[stage.axis], upper[stage.axis], share)
        ring = None if ring is None else hull_vertices(stage.X_PJ.apply(ring))
    return ring


def _kept(ring: FloatArray, stage: Stage, first: float, last: float, tolerance: float) -> FloatArray | None:
    """Points that every copy of a convex ring covers which one joint makes of it."""
    first, last = sorted((stage.scale * first, stage.scale * last))
    normals, offsets = _half_planes(ring)
    if stage.kind == "prismatic":
        kept: FloatArray | None = ring + first * stage.direction
        slides = normals @ stage.direction
        for normal, offset in zip(normals, offsets + np.minimum(first * slides, last * slides), strict=True):
            kept = None if kept is None else _cut(kept, normal, offset - HAIR)
        return kept
    return _common_to_turns(normals, offsets - HAIR, ring, (first, last), tolerance)


def _common_to_turns(
    normals: FloatArray, offsets: FloatArray, ring: FloatArray, turn: tuple[float, float], tolerance: float
) -> FloatArray | None:
    """Points x with n(a + t) . x <= h for every half-plane (a, h) and every t of the turn.

    The left side is largest where a + t is nearest to the bearing of x, which gives it in closed form. The
    set is convex: a polygon lies in it as soon as its vertices do. Wherever one does not, the half-plane
    that it violates most cuts it off, a little deeper than needed.
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
    """The part of a convex ring with n . x <= offset, None where no more than a corner is left."""
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
    """Points on a circle whose polygon leaves out no more than the tolerance, shape (k, 2)."""
    count = max(8, ceil(2.0 * pi / sqrt(8.0 * tolerance / max(radius, tolerance))))
    return radius * turned(np.array([[1.0, 0.0]]), 2.0 * pi * np.arange(count) / count)


def _rounded(solid: Solid, tolerance: float) -> FloatArray:
    """Polygon inside a hull grown by a radius; it has the corners where arcs meet straight sides."""
    radius, ring = solid.radius - HAIR, solid.vertices
    arcs = ring[:, None, :] + inscribed_circle(radius, tolerance)
    sides = np.roll(ring, -1, axis=0) - ring
    outward = radius * np.stack((sides[:, 1], -sides[:, 0]), axis=1) / np.hypot(*sides.T)[:, None]
    corners = (ring + outward, np.roll(ring, -1, axis=0) + outward)
    return hull_vertices(np.concatenate((arcs.reshape(-1, 2), *corners)))


def _common_to_discs(centres: FloatArray, radius: float, tolerance: float) -> FloatArray | None:
    """Polygon inside every disc of one radius about the points of a convex set.

    Its vertices are where rays from the middle leave the first disc, and where two neighbouring circles
    cross; a point is near enough to all of the set if it is to its vertices.
    """
    middle = 0.5 * (centres.min(axis=0) + centres.max(axis=0))
    away = middle - centres
    room = radius**2 - np.einsum("ij,ij->i", away, away)
    if (room <= 0.0).any():
        return None
    rays = inscribed_circle(1.0, tolerance / max(radius, tolerance))
    along = rays @ away.T
    reach = np.sqrt(along**2 + room) - along
    nearest = np.argmin(reach, axis=1)
    after = np.roll(nearest, -1)
    crossings = _crossings(centres[nearest[nearest != after]], centres[after[nearest != after]], radius)
    candidates = np.concatenate((middle + rays * reach.min(axis=1)[:, None], crossings))
    distances = np.hypot(*(candidates[:, None, :] - centres).transpose(2, 0, 1)).max(axis=1)
    return hull_vertices(candidates[distances <= radius + 0.1 * HAIR])


def _crossings(first: FloatArray, second: FloatArray, radius: float) -> FloatArray:
    """Both points where circles of one radius about two centres each cross; shapes (k, 2) to (2 k, 2)."""
    across = second - first
    square = np.einsum("ij,ij->i", across, across)
    height = np.sqrt(np.maximum(radius**2 / square - 0.25, 0.0))[:, None]
    side = height * np.stack((-across[:, 1], across[:, 0]), axis=1)
    middle = 0.5 * (first + second)
    return np.concatenate((middle + side, middle - side))
