"""The edges of the floor, and the positions at which a convex footprint meets one of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.tree.pose import FloatArray

__all__ = ["FloorEdges", "edge_obstacles", "floor_edges"]


@dataclass(frozen=True)
class FloorEdges:
    """The edges of a floor's outer ring and of its holes.

    Attributes:
        floor: The floor W.
        starts: First end of every edge, shape (E, 2) [m].
        ends: Second end, shape (E, 2) [m].
    """

    floor: Polygon
    starts: FloatArray
    ends: FloatArray

    def near(self, bounds: FloatArray) -> NDArray[np.bool_]:
        """Which edges have bounding boxes that meet a box (x_min, y_min, x_max, y_max), shape (E,)."""
        low, high = np.minimum(self.starts, self.ends), np.maximum(self.starts, self.ends)
        return np.asarray(((low <= bounds[2:]) & (high >= bounds[:2])).all(axis=1), dtype=np.bool_)


def floor_edges(floor: Polygon) -> FloorEdges:
    """List the edges of a floor."""
    rings = [shapely.get_coordinates(ring) for ring in (floor.exterior, *floor.interiors)]
    starts, ends = ([ring[:-1] for ring in rings], [ring[1:] for ring in rings])
    return FloorEdges(floor, np.concatenate(starts), np.concatenate(ends))


def edge_obstacles(starts: FloatArray, ends: FloatArray, ring: FloatArray) -> NDArray[np.object_]:
    """Configuration-space obstacles of edges: positions at which a convex footprint F meets an edge e.

    They are the Minkowski sums e + (-F), each the convex hull of -F moved to both ends of e.

    Args:
        starts: First ends of the edges, shape (E, 2) [m].
        ends: Second ends, shape (E, 2) [m].
        ring: Vertices of F relative to the position, shape (m, 2) [m].

    Returns:
        One convex geometry for every edge, shape (E,).
    """
    copies = np.concatenate((starts[:, None, :] - ring, ends[:, None, :] - ring), axis=1)
    return np.asarray(shapely.convex_hull(shapely.linestrings(copies)), dtype=np.object_)
