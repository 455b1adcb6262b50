"""The gap between two walls: the two points that pinch whatever is to pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import LineString, Polygon
from shapely.geometry.polygon import orient

from coop_drake.geometry.boundary import edges_of
from coop_drake.tree.pose import FloatArray

__all__ = ["Gap", "narrowest_gap"]

_FACING = 0.3
_AWAY = 1e-6


@dataclass(frozen=True)
class Gap:
    """Two points of the walls that face each other across the floor.

    Attributes:
        first: One of them, shape (2,) [m].
        second: The other, shape (2,) [m].
    """

    first: FloatArray
    second: FloatArray

    @property
    def width(self) -> float:
        """Their distance [m]."""
        return float(np.hypot(*(self.second - self.first)))


def narrowest_gap(workspace: Polygon, walls: Sequence[FloatArray]) -> Gap | None:
    """The narrowest gap that one of some points of the walls makes with the walls across.

    Args:
        workspace: The floor W [m].
        walls: Points of its boundary, shape (2,) each [m].

    Returns:
        The gap, None where no wall faces any of the points.
    """
    edges = edges_of(orient(workspace))  # The floor lies to the left of every edge.
    floor = workspace.buffer(_AWAY, join_style="mitre")
    gaps = [gap for wall in walls for gap in _gaps(edges, floor, wall)[:1]]
    return min(gaps, key=lambda gap: gap.width, default=None)


def _gaps(edges: FloatArray, floor: Polygon, wall: FloatArray) -> list[Gap]:
    """The narrowest gap at one point of the walls, as a list of at most one."""
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    length = np.maximum(np.hypot(*along.T), 1e-12)
    inward = np.column_stack((-along[:, 1], along[:, 0])) / length[:, None]
    share = np.clip(((wall - start) * along).sum(axis=1) / length**2, 0.0, 1.0)
    across = start + share[:, None] * along
    away = across - wall
    width = np.hypot(*away.T)
    direction = away / np.maximum(width, 1e-12)[:, None]
    own = inward[width <= _AWAY]  # Normals of the edges that the point itself lies on: two at a corner.
    faced = (direction @ own.T).max(axis=1, initial=-1.0) >= _FACING
    facing = (inward * direction).sum(axis=1) <= -_FACING
    for index in np.argsort(width, kind="stable"):
        if faced[index] and facing[index] and width[index] > _AWAY:
            line = LineString([wall, across[index]])
            if floor.covers(line):
                return [Gap(wall, across[index])]
    return []
