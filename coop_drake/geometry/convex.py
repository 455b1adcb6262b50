"""Convex polygons as sets of supporting lines ``n(angle) . x <= offset``: the arithmetic of all sweeps."""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.geometry.pose import FloatArray

SLACK = 1e-9
"""Directed rounding [m]: outer offsets grow and inner offsets shrink by it."""

_TURN = 2.0 * pi
_QUARTER_TURN = np.array([-1.0, 1.0])


def following(ring: FloatArray) -> FloatArray:
    """Ring that starts one entry later; shape (n, ...) to the same."""
    return np.concatenate((ring[1:], ring[:1]))


def preceding(ring: FloatArray) -> FloatArray:
    """Ring that starts one entry earlier; shape (n, ...) to the same."""
    return np.concatenate((ring[-1:], ring[:-1]))


def normals(angles: FloatArray) -> FloatArray:
    """Unit vectors at the angles; shape (k,) [rad] to (k, 2)."""
    result = np.empty((*angles.shape, 2))
    np.cos(angles, out=result[..., 0])
    np.sin(angles, out=result[..., 1])
    return result


def edge_angles(vertices: FloatArray) -> FloatArray:
    """Angles of the outward normals of a counter-clockwise ring; shape (n, 2) to (n,), empty for a point.

    Two vertices make a segment with a normal on either side.
    """
    if len(vertices) < 2:
        return np.empty(0)
    edges = following(vertices) - vertices
    return np.arctan2(-edges[:, 0], edges[:, 1])


def half_planes_polygon(angles: FloatArray, offsets: FloatArray) -> FloatArray | None:
    """Intersection of half-planes that bound a polygon, a hair inside.

    Every line is cut by all others at once, which needs no loop: line i keeps the stretch between the
    largest of its lower and the smallest of its upper crossings.

    Args:
        angles: Directions of the outward normals, shape (k,) [rad].
        offsets: Signed distances of the lines from the origin, shape (k,) [m].

    Returns:
        Vertices, counter-clockwise, shape (m, 2), or None where the intersection has no interior.
    """
    angles = np.mod(angles, _TURN)
    order = np.lexsort((offsets, angles))
    angles, h = angles[order], offsets[order] - SLACK
    first = np.ones(len(angles), dtype=bool)
    first[1:] = angles[1:] - angles[:-1] > 1e-12
    angles, h = angles[first], h[first]
    n = normals(angles)
    sine = n[:, :1] * n[:, 1] - n[:, 1:] * n[:, 0]
    room = h - h[:, None] * (n @ n.T)
    parallel = np.abs(sine) < 1e-12
    blocked = (parallel & (room < -1e-12)).any(axis=1)
    crossing = room / np.where(parallel, 1.0, sine)
    upper = np.where(~parallel & (sine > 0.0), crossing, np.inf).min(axis=1)
    lower = np.where(~parallel & (sine < 0.0), crossing, -np.inf).max(axis=1)
    kept = ~blocked & (upper - lower > 1e-9)
    if kept.sum() < 3:
        return None
    n, h, upper = n[kept], h[kept, None], upper[kept, None]
    vertices: FloatArray = h * n + upper * (n[:, ::-1] * _QUARTER_TURN)
    return vertices
