"""What a solid can touch while its joints move: hulls of circumscribed arcs, by plain trigonometry."""

from __future__ import annotations

from math import ceil, cos, sqrt

import numpy as np
import shapely
from shapely import LineString, Point

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.solids import Solid, Stage

__all__ = ["outer_sweep"]

LARGEST_STEP = 0.5
"""Arcs are cut into steps of at most this angle [rad]."""

ALMOST = 1e-9
"""Vertices that are furthest in their own direction up to so much keep their arcs [-, m²]."""


def outer_sweep(
    solid: Solid, lower: FloatArray, upper: FloatArray, tolerance: float, stages: int | None = None
) -> FloatArray:
    """Enclose the hull of a solid's vertices at every configuration of a slice; its radius is left to add.

    Joint by joint the convex set is replaced by the hull of the arcs (or segments) that its vertices
    describe. An arc about the pivot in steps of beta lies in the hull of its ends and of the points at
    r / cos(beta / 2) half-way, which stands out by less than about r beta^2 / 8.

    Args:
        solid: The solid.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        tolerance: How far the result may stand out of the sweep's hull [m].
        stages: How many joints to sweep, from the solid's own; None for all and theta, which gives
            directions of W about the object's origin.

    Returns:
        Vertices of a convex polygon, or of a segment, or one point, shape (m, 2) [m].
    """
    moving = solid.stages[:stages]
    ring = solid.vertices
    for stage in moving:
        first, last = lower[stage.axis], upper[stage.axis]
        points = _carried(ring, stage, first, last, tolerance / len(moving))
        ring = hull_vertices(stage.X_PJ.apply(points))
    return ring


def hull_vertices(points: FloatArray) -> FloatArray:
    """Vertices of the convex hull of points; shape (k, 2) to (m, 2)."""
    chain = LineString(points) if len(points) > 1 else Point(points[0])
    vertices: FloatArray = shapely.get_coordinates(chain.convex_hull)
    closed = len(vertices) > 1 and bool((vertices[0] == vertices[-1]).all())
    return vertices[:-1] if closed else vertices


def turned(points: FloatArray, angles: FloatArray) -> FloatArray:
    """Every point turned about the origin by every angle; shapes (n, 2), (k,) to (k n, 2)."""
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y = points[:, 0], points[:, 1]
    result: FloatArray = np.stack((c * x - s * y, s * x + c * y), axis=-1).reshape(-1, 2)
    return result


def _carried(ring: FloatArray, stage: Stage, first: float, last: float, tolerance: float) -> FloatArray:
    """Points whose hull holds every copy of a ring that one joint makes of it.

    In a direction in which neither of the turned ends reaches furthest, the furthest point v is at a
    standstill while the ring turns: v is the ring's own furthest point in the direction of v. Only such
    vertices need their arcs.
    """
    first, last = stage.scale * first, stage.scale * last
    if stage.kind == "prismatic":
        return np.concatenate((ring + first * stage.direction, ring + last * stage.direction))
    if first == last:
        return turned(ring, np.array([first]))
    ends = turned(ring, np.array([first, last]))
    square = np.einsum("ij,ij->i", ring, ring)
    ring = ring[(ring @ ring.T).max(axis=1) <= square * (1.0 + ALMOST) + ALMOST]
    reach = max(sqrt(float(square.max())), tolerance)
    step = min(sqrt(8.0 * tolerance / reach), LARGEST_STEP)
    parts = ceil(abs(last - first) / step)
    step = (last - first) / parts
    middles = first + step * (np.arange(parts, dtype=np.float64) + 0.5)
    return np.concatenate((ends, turned(ring / cos(0.5 * step), middles)))
