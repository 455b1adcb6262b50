"""Conservative under-sweeps of one convex piece over one joint's interval, eq. (6) stage by stage.

A stage maps convex sets to convex sets: the over-sweep encloses every placed copy, the under-sweep is
enclosed by every placed copy. Rigid motions are bijections, so stages nest over a product of intervals.
"""

from __future__ import annotations

from math import pi

import numpy as np

from coop_drake.geometry.convex import edge_angles, half_planes_polygon, normals, preceding
from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.sweep_kernels import arc_parts, closed_directions

_NUDGE = 1e-6


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
