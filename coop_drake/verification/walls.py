"""Walls of a floor, and what a footprint's sums with them forbid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from coop_drake.tree.pose import FloatArray

__all__ = ["Walls", "wall_edges", "wall_sums"]


@dataclass(frozen=True)
class Walls:
    """The edges of a floor's rings, holes among them.

    Attributes:
        floor: The floor W.
        starts: First end of every edge, shape (E, 2) [m].
        ends: Second end, shape (E, 2) [m].
    """

    floor: Polygon
    starts: FloatArray
    ends: FloatArray

    def near(self, bounds: FloatArray) -> NDArray[np.bool_]:
        """Edges whose boxes meet a box (x_min, y_min, x_max, y_max), shape (E,)."""
        low, high = np.minimum(self.starts, self.ends), np.maximum(self.starts, self.ends)
        return np.asarray(((low <= bounds[2:]) & (high >= bounds[:2])).all(axis=1), dtype=np.bool_)


def wall_edges(floor: Polygon) -> Walls:
    """Take a floor's rings apart."""
    rings = [shapely.get_coordinates(ring) for ring in (floor.exterior, *floor.interiors)]
    return Walls(
        floor,
        np.concatenate([ring[:-1] for ring in rings]),
        np.concatenate([ring[1:] for ring in rings]),
    )


def wall_sums(starts: FloatArray, ends: FloatArray, ring: FloatArray) -> NDArray[np.object_]:
    """Positions at which a convex footprint meets each of some edges: the hulls of e + (-F).

    Args:
        starts: First ends of edges, shape (E, 2) [m].
        ends: Second ends, shape (E, 2) [m].
        ring: Vertices of the footprint F relative to the position, shape (m, 2) [m].

    Returns:
        One convex geometry for every edge, shape (E,).
    """
    copies = np.concatenate((starts[:, None, :] - ring, ends[:, None, :] - ring), axis=1)
    return np.asarray(shapely.convex_hull(shapely.linestrings(copies)), dtype=np.object_)
