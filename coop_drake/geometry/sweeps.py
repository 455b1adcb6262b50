"""Conservative sweeps of one convex piece over one joint's interval, eq. (6) stage by stage.

A stage maps convex sets to convex sets: the over-sweep encloses every placed copy, the under-sweep is
enclosed by every placed copy. Rigid motions are bijections, so stages nest over a product of intervals.
"""

from __future__ import annotations

from math import ceil, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from coop_drake.geometry.convex import (
    circumscribed,
    closed_directions,
    edge_angles,
    following,
    half_planes_polygon,
    normals,
    preceding,
    support,
)
from coop_drake.geometry.pose import FloatArray

_ARC_SHARE = 10.0
_NUDGE = 1e-6


def arc_parts(half_width: float) -> int:
    """How many chords or tangents stand in for an arc: their error vanishes faster than the slice's."""
    return max(1, ceil(sqrt(_ARC_SHARE * min(half_width, pi))))


def disc_turn(half_width: float) -> float:
    """Largest angle between neighbouring normals of a polygon that stands in for a disc [rad]."""
    return min(0.6, max(0.05, 0.9 * sqrt(half_width))) if half_width > 0.0 else 0.6


def over_revolute(vertices: FloatArray, centre: float, half_width: float) -> FloatArray:
    """Enclose a convex set turned about the origin by every angle of an interval.

    The support function of the sweep is the largest of the set's over a window of directions. Its
    directions are the edges' normals at both ends of the interval, and tangents to the arcs of those
    vertices that are locally furthest from the pivot.

    Args:
        vertices: Convex ring, counter-clockwise, or one point or a segment, shape (n, 2) [m].
        centre: Middle of the interval [rad].
        half_width: Half of its width [rad].

    Returns:
        Vertices of an enclosing convex polygon, shape (m, 2).
    """
    radii = np.hypot(vertices[:, 0], vertices[:, 1])
    bearings = np.arctan2(vertices[:, 1], vertices[:, 0])
    edges = edge_angles(vertices)
    arcs = _furthest(vertices) & (radii > 0.0)
    parts = arc_parts(half_width)
    fan = half_width * np.linspace(-1.0, 1.0, parts + 1)
    across = np.array([-0.5, 0.5, 1.0]) * pi if len(vertices) < 3 else np.empty(0)
    directions = closed_directions(
        np.concatenate(
            (
                edges - half_width,
                edges + half_width,
                (bearings[arcs][:, None] + fan).ravel(),
                (bearings[:1, None] + across).ravel(),
            )
        )
        + centre
    )
    off = directions[:, None] - (bearings + centre)
    off = np.maximum(np.abs(off - 2.0 * pi * np.rint(off / (2.0 * pi))) - half_width, 0.0)
    offsets = (radii * np.cos(off)).max(axis=1)
    return circumscribed(directions, offsets)


def _furthest(vertices: FloatArray) -> NDArray[np.bool_]:
    """Which vertices are no nearer to the origin than the points of their edges close by, shape (n,)."""
    if len(vertices) < 2:
        return np.ones(len(vertices), dtype=bool)
    to_next = following(vertices) - vertices
    to_last = preceding(vertices) - vertices
    nearer_next = np.einsum("ij,ij->i", to_next, vertices) <= 0.0
    nearer_last = np.einsum("ij,ij->i", to_last, vertices) <= 0.0
    outermost: NDArray[np.bool_] = nearer_next & nearer_last
    return outermost


def over_prismatic(vertices: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """Enclose a convex set moved along a segment of displacements: the hull of both end copies.

    Args:
        vertices: Convex ring or one point or a segment, shape (n, 2) [m].
        first: Displacement at the interval's lower end, shape (2,) [m].
        last: Displacement at its upper end, shape (2,) [m].
    """
    motion = last - first
    heading = np.arctan2(motion[1], motion[0]) + np.array([-0.5, 0.0, 0.5, 1.0]) * pi
    directions = closed_directions(np.concatenate((edge_angles(vertices), heading)))
    n = normals(directions)
    return circumscribed(directions, support(vertices, directions) + np.maximum(n @ first, n @ last))


def under_revolute(vertices: FloatArray, centre: float, half_width: float) -> FloatArray | None:
    """Find points that a convex polygon covers at every angle of an interval about the origin.

    Every half-plane becomes its two extreme turns and, where it holds the pivot, chords of the circle that
    it envelops. A half-plane without the pivot and a turn by pi or more leave nothing.

    Returns:
        Vertices of an enclosed convex polygon, shape (m, 2), or None where none was found.
    """
    angles = edge_angles(vertices)
    offsets = np.einsum("ij,ij->i", normals(angles), vertices)
    if half_width >= 0.5 * pi and (offsets <= 0.0).any():
        return None
    parts = arc_parts(half_width)
    half_chord = half_width / parts
    middles = half_chord * (2.0 * np.arange(parts) + 1.0 - parts)
    around = offsets > 0.0
    return half_planes_polygon(
        np.concatenate(
            (angles - half_width, angles + half_width, (angles[around][:, None] + middles).ravel())
        )
        + centre,
        np.concatenate((offsets, offsets, np.repeat(offsets[around] * np.cos(half_chord), parts))),
    )


def under_prismatic(vertices: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray | None:
    """Find points that a convex polygon covers at every displacement of a segment: both ends' overlap."""
    angles = edge_angles(vertices)
    n = normals(angles)
    offsets = np.einsum("ij,ij->i", n, vertices)
    return half_planes_polygon(angles, offsets + np.minimum(n @ first, n @ last))


def grown(vertices: FloatArray, radius: float, largest_turn: float) -> FloatArray:
    """Enclose a convex set grown by a radius in a polygon.

    Args:
        vertices: Convex ring or one point or a segment, shape (n, 2) [m].
        radius: Growth [m].
        largest_turn: Largest angle between neighbouring normals [rad].
    """
    directions = closed_directions(edge_angles(vertices), largest_turn)
    return circumscribed(directions, support(vertices, directions) + radius)


def inscribed(vertices: FloatArray, radius: float, largest_turn: float) -> FloatArray:
    """Polygon inside a convex set grown by a radius: its vertices lie on arcs about the set's vertices."""
    directions = closed_directions(edge_angles(vertices), largest_turn)
    before, after = normals(directions - _NUDGE), normals(directions + _NUDGE)
    corners = np.stack(
        (np.argmax(before @ vertices.T, axis=1), np.argmax(after @ vertices.T, axis=1)), axis=1
    )
    ring = (vertices[corners] + radius * normals(directions)[:, None, :]).reshape(-1, 2)
    distinct: FloatArray = ring[np.abs(ring - preceding(ring)).max(axis=1) > 1e-9]
    return distinct


def common_disc(centres: FloatArray, radius: float, largest_turn: float) -> FloatArray | None:
    """Polygon inside every disc of one radius whose centre lies in a convex polygon.

    A point is within the radius of every centre if it is of every vertex; from their middle each ray leaves
    the common part at the nearest exit.

    Args:
        centres: Vertices that enclose the centres, shape (n, 2) [m].
        radius: Radius of all discs [m].
        largest_turn: Angle between neighbouring vertices of the result [rad].
    """
    middle = 0.5 * (centres.min(axis=0) + centres.max(axis=0))
    away = middle - centres
    room = radius**2 - np.einsum("ij,ij->i", away, away)
    if (room <= 0.0).any():
        return None
    rays = normals(closed_directions(np.empty(0), largest_turn))
    along = rays @ away.T
    reach = (np.sqrt(along**2 + room) - along).min(axis=1) * (1.0 - 1e-9)
    ring: FloatArray = middle + reach[:, None] * rays
    return ring
