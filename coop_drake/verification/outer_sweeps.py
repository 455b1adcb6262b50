"""Outer sweeps: convex polygons that hold a solid at every configuration of a slice.

A revolute joint moves a vertex on an arc, which lies inside the polygon circumscribed about it.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, cos, sqrt

import numpy as np
import shapely
from shapely import LineString, Point

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.solids import Solid, Stage

__all__ = ["outer_sweep"]

LARGEST_STEP = 0.5
"""Arcs are cut into steps of at most this angle, for which 1 / cos(beta / 2) is near 1 + beta^2 / 8 [rad]."""

SAME_RADIUS = 0.1
"""Vertices on one arc have radii that differ by no more than this fraction of the tolerance [-]."""

ALMOST = 1e-9
"""Rounding in the test for vertices that need an arc; too large a value only keeps more arcs [-, m²]."""


def outer_sweep(
    solid: Solid, lower: FloatArray, upper: FloatArray, tolerance: float, stages: int | None = None
) -> FloatArray:
    """Enclose the vertices of a solid at every configuration of a slice; the caller adds the solid's radius.

    Joint by joint the convex set is replaced by the hull of the arcs (or segments) on which the joint moves
    its vertices. An arc about the pivot in steps of beta lies in the hull of its ends and of the points at
    r / cos(beta / 2) half-way, which stands out by less than about r beta^2 / 8.

    Args:
        solid: The solid.
        lower: Lower ends of (theta, q...), shape (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        tolerance: How far the result may stand out of the sweep's hull [m].
        stages: How many stages to sweep, from the solid's own joint on; None for all with theta, which
            gives vertices relative to the object's origin, in directions of W.

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
    line = LineString(points) if len(points) > 1 else Point(points[0])
    vertices: FloatArray = shapely.get_coordinates(line.convex_hull)
    closed = len(vertices) > 1 and bool((vertices[0] == vertices[-1]).all())
    return vertices[:-1] if closed else vertices


def turned(points: FloatArray, angles: FloatArray) -> FloatArray:
    """Every point turned about the origin by every angle; shapes (n, 2), (k,) to (k n, 2)."""
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y = points[:, 0], points[:, 1]
    result: FloatArray = np.stack((c * x - s * y, s * x + c * y), axis=-1).reshape(-1, 2)
    return result


def _carried(ring: FloatArray, stage: Stage, first: float, last: float, tolerance: float) -> FloatArray:
    """Points whose hull holds a ring at all values of one joint.

    Take the direction d in which the sweep reaches furthest with a vertex v, not at an end of the turn.
    Turning a little either way does not bring v further along d, so v is parallel to d, and the ring reaches
    furthest along v with v itself. Only such vertices need their arcs.
    """
    first, last = stage.scale * first, stage.scale * last
    if stage.kind == "prismatic":
        return np.concatenate((ring + first * stage.direction, ring + last * stage.direction))
    if first == last:
        return turned(ring, np.array([first]))
    ends = turned(ring, np.array([first, last]))
    square = np.einsum("ij,ij->i", ring, ring)
    ring = ring[(ring @ ring.T).max(axis=1) <= square * (1.0 + ALMOST) + ALMOST]
    radii, bearings = np.hypot(*ring.T), np.arctan2(ring[:, 1], ring[:, 0])
    step = min(sqrt(8.0 * tolerance / max(float(radii.max()), tolerance)), LARGEST_STEP)
    points = [ends]
    for radius, begin, end in _arcs(radii, bearings, abs(last - first), tolerance):
        turn = end - begin + abs(last - first)
        parts = ceil(turn / step)
        middles = begin + min(first, last) + turn / parts * (np.arange(parts, dtype=np.float64) + 0.5)
        corner = np.array([[radius / cos(0.5 * turn / parts), 0.0]])
        points.append(turned(corner, middles))
    return np.concatenate(points)


def _arcs(
    radii: FloatArray, bearings: FloatArray, turn: float, tolerance: float
) -> Iterator[tuple[float, float, float]]:
    """Radius, first and last bearing of arcs of vertices; vertices whose arcs overlap when turned share one.

    Otherwise a joint that turns about the same point as the one before would multiply the vertices.
    """
    bins = np.floor(radii / (SAME_RADIUS * tolerance))
    order = np.lexsort((bearings, bins))
    new = (np.diff(bins[order]) != 0.0) | (np.diff(bearings[order]) > turn)
    for group in np.split(order, np.flatnonzero(new) + 1):
        yield float(radii[group].max()), float(bearings[group[0]]), float(bearings[group[-1]])
