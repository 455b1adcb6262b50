"""The corridor around a passage: a region without the bays that the passage only goes by."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from coop_drake.compiled import compiled
from coop_drake.geometry.boundary import BoundaryDistance, signed_distance
from coop_drake.geometry.parts import component_at
from coop_drake.tree.pose import FloatArray

STRIDE = 0.5
"""Distance of the discs along the path, over the clearance there [-]."""

SHORTEST_STRIDE = 5e-3
"""The stride is at least this where the clearance is small [m]."""

VERTICES = 16
"""Vertices of a disc."""

_ANGLES = np.arange(VERTICES) * (2.0 * pi / VERTICES)
CIRCLE = np.stack((np.cos(_ANGLES), np.sin(_ANGLES)), axis=1)
"""Vertices of a unit disc about the origin, shape (VERTICES, 2) [-]."""


def corridor_around(polygon: Polygon, path: LineString, widening: float) -> Polygon:
    """Keep what lies within ``widening`` times the clearance of each point of a path.

    A field that is harmonic in the corridor follows the path more closely than one that fills every bay, and
    the path keeps its clearance: its distance to the corridor's boundary is its distance to the region's.

    Args:
        polygon: The region [m].
        path: A path inside it [m].
        widening: How many clearances wide the corridor is to either side, above 1 [-].

    Returns:
        The part of the corridor that holds the path's start.
    """
    edges = BoundaryDistance(polygon).edges
    centres = _stops(edges, shapely.get_coordinates(path))
    rings = centres[:, None, :2] + widening * centres[:, None, 2:] * CIRCLE
    pairs = np.concatenate((rings[:-1], rings[1:]), axis=1) if len(rings) > 1 else rings
    links = shapely.convex_hull(shapely.multipoints(pairs))
    return component_at(shapely.union_all(links).intersection(polygon), Point(path.coords[0]))


@compiled
def _stops(edges: FloatArray, path: FloatArray) -> FloatArray:
    """Places along a path, both ends among them, with their clearances (x, y, d), shape (k, 3)."""
    stops = []
    left = 0.0
    for k in range(len(path) - 1):
        x, y = path[k, 0], path[k, 1]
        dx, dy = path[k + 1, 0] - x, path[k + 1, 1] - y
        length = sqrt(dx * dx + dy * dy)
        while left < length:
            px, py = x + left / length * dx, y + left / length * dy
            clearance = signed_distance(edges, px, py)
            stops.append((px, py, clearance))
            left += max(STRIDE * clearance, SHORTEST_STRIDE)
        left -= length
    x, y = path[-1, 0], path[-1, 1]
    stops.append((x, y, signed_distance(edges, x, y)))
    return np.array(stops)
