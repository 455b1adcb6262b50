"""The corridor around a passage: a region without the bays that the passage only goes by."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.geometry.slits import component_at

__all__ = ["corridor_around"]

STRIDE = 0.5
"""Distance of the discs along the path, over the clearance there [-]."""

SHORTEST_STRIDE = 5e-3
"""And at least this, where there is hardly any clearance [m]."""

QUARTER_VERTICES = 4
"""Vertices of a quarter of a disc."""


def corridor_around(polygon: Polygon, path: LineString, widening: float) -> Polygon:
    """Keep what lies within ``widening`` times the clearance of each point of a path.

    A field that is harmonic in the corridor follows the path more closely than one that fills every bay, and
    nothing is lost on the path itself: its distance to the corridor's boundary is its clearance as before.

    Args:
        polygon: The region [m].
        path: A path inside it [m].
        widening: How many clearances wide the corridor is to either side, above 1 [-].

    Returns:
        The part of the corridor that holds the path's start.
    """
    distance = BoundaryDistance(polygon)
    discs, s = [], 0.0
    while s < path.length:
        point = path.interpolate(s)
        room = distance(np.array(point.coords[0]))
        discs.append(point.buffer(widening * room, quad_segs=QUARTER_VERTICES))
        s += max(STRIDE * room, SHORTEST_STRIDE)
    end = Point(path.coords[-1])
    discs.append(end.buffer(widening * distance(np.array(end.coords[0])), quad_segs=QUARTER_VERTICES))
    links = [shapely.union(first, second).convex_hull for first, second in pairwise(discs)] or discs
    return component_at(shapely.union_all(links).intersection(polygon), Point(path.coords[0]))
