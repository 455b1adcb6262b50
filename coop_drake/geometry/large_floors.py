"""The Minkowski difference of eq. (9) and intersections on floors with very many corners.

The clipping library sweeps a line over the plane and looks for the place of every corner among all edges
that the line meets, one by one: where a horizontal wall has tens of thousands of corners, the time grows
with their square. Here the plane is turned first, so that walls that are parallel to the axes, as most long
ones are, meet the line in few places.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import cos, radians, sin

import numpy as np
import shapely
from manifold3d import CrossSection, FillRule, OpType

from coop_drake.tree.pose import FloatArray

LARGE = 10_000
"""Number of corners from which on the plane is turned [-]: below, it saves less than a tenth of a second."""

_TURN = 29.3
"""How far the plane is turned [degrees]: away from all multiples of 15, at which walls are likely."""

_EDGES, _PARTS = 8, 4
"""How many edges are united at once at first, and how many unions of neighbours later: few overlap."""


def common(first: CrossSection, second: CrossSection) -> CrossSection:
    """Intersection of two regions."""
    if first.num_vert() + second.num_vert() < LARGE:
        return first ^ second
    return (first.rotate(_TURN) ^ second.rotate(_TURN)).rotate(-_TURN)


def fitting_on_large_floor(
    rings: Sequence[FloatArray], edges: FloatArray, footprint: FloatArray
) -> CrossSection:
    """Positions p with p + F inside a floor: where F's first vertex is inside and F meets no wall.

    Neighbouring edges are united first: their sums with -F overlap so much that all at once would cross in as
    many places as there are pairs of edges within a footprint.

    Args:
        rings: The floor's rings, outer ones counter-clockwise, holes clockwise, shape (n, 2) each [m].
        edges: All their edges (x0, y0, x1, y1) in order, shape (E, 4) [m].
        footprint: Convex ring F, shape (n, 2) [m].
    """
    sums = _turned(edges.reshape(-1, 2, 1, 2) - footprint).reshape(len(edges), -1, 2)
    corners, owner = shapely.get_coordinates(
        shapely.convex_hull(shapely.linestrings(sums)), return_index=True
    )
    bounds = [0, *(np.flatnonzero(np.diff(owner)) + 1).tolist(), len(corners)]
    hulls = [corners[a : b - 1] for a, b in pairwise(bounds)]
    walls = [CrossSection(hulls[k : k + _EDGES], FillRule.NonZero) for k in range(0, len(hulls), _EDGES)]
    while len(walls) > 1:
        walls = [
            CrossSection.batch_boolean(walls[k : k + _PARTS], OpType.Add)
            for k in range(0, len(walls), _PARTS)
        ]
    floor = CrossSection([_turned(ring - footprint[0]) for ring in rings], FillRule.Positive)
    return (floor - walls[0]).rotate(-_TURN)


def _turned(points: FloatArray) -> FloatArray:
    """Points, shape (..., 2), in the turned plane."""
    c, s = cos(radians(_TURN)), sin(radians(_TURN))
    turned: FloatArray = points @ np.array([[c, s], [-s, c]])
    return turned
