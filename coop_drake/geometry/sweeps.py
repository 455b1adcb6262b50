"""Conservative under-sweeps of one convex piece over one joint's interval, eq. (6) stage by stage.

A stage maps convex sets to convex sets: the over-sweep encloses every placed copy, the under-sweep is
enclosed by every placed copy. Rigid motions are bijections, so stages nest over a product of intervals.

The formulas are compiled: over-sweeps of one joint are ``over_revolute`` and ``over_prismatic`` of
``sweep_kernels.py``, and ``over_piece`` there applies them from a link to the object; under-sweeps are in
``under_kernels.py``. ``SweptTree`` keeps the results of both. The verifier has over-sweeps of its own, in
``verification``.
"""

from __future__ import annotations

import numpy as np

from coop_drake.geometry import under_kernels
from coop_drake.geometry.convex import edge_angles, normals, preceding
from coop_drake.geometry.sweep_kernels import closed_directions
from coop_drake.tree.pose import FloatArray

_NUDGE = 1e-6


def under_revolute(vertices: FloatArray, centre: float, half_width: float) -> FloatArray | None:
    """Points that a convex polygon covers at every angle of an interval about the origin, None if none."""
    return _or_none(under_kernels.under_revolute(vertices, centre, half_width))


def under_prismatic(vertices: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray | None:
    """Points that a convex polygon covers at every displacement from first to last, (2,) each, or None."""
    return _or_none(under_kernels.under_prismatic(vertices, first[0], first[1], last[0], last[1]))


def common_disc(centres: FloatArray, radius: float, largest_turn: float) -> FloatArray | None:
    """Polygon inside every disc of one radius whose centre lies in a convex polygon, None if none."""
    return _or_none(under_kernels.common_disc(centres, radius, largest_turn))


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


def _or_none(ring: FloatArray) -> FloatArray | None:
    return ring if len(ring) else None
