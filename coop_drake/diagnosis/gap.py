"""The gap between two walls that face each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import LineString, Polygon
from shapely.geometry.polygon import orient

from coop_drake.geometry.boundary import edges_of
from coop_drake.tree.pose import FloatArray

FACING = 0.3
"""Cosine of the largest angle between a wall's normal and the direction to the wall that it faces [-]."""

AWAY = 1e-6
"""Points nearer than this are the same [m]."""


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
    """The narrowest gap between some points of the walls, (2,) each [m], and the walls across the floor.

    None where no wall faces any of the points.
    """
    edges = edges_of(orient(workspace))  # The floor lies to the left of every edge.
    floor = workspace.buffer(AWAY, join_style="mitre")
    gaps = [_gap(edges, floor, wall) for wall in walls]
    return min((gap for gap in gaps if gap is not None), key=lambda gap: gap.width, default=None)


def _gap(edges: FloatArray, floor: Polygon, wall: FloatArray) -> Gap | None:
    """The narrowest gap at one point of the walls."""
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    length = np.maximum(np.hypot(*along.T), 1e-12)
    inward = np.column_stack((-along[:, 1], along[:, 0])) / length[:, None]
    fraction = np.clip(((wall - start) * along).sum(axis=1) / length**2, 0.0, 1.0)
    across = start + fraction[:, None] * along
    away = across - wall
    width = np.hypot(*away.T)
    direction = away / np.maximum(width, 1e-12)[:, None]
    own = inward[width <= AWAY]  # Normals of the edges that the point itself lies on: two at a corner.
    faced = (direction @ own.T).max(axis=1, initial=-1.0) >= FACING
    facing = (inward * direction).sum(axis=1) <= -FACING
    for index in np.argsort(width, kind="stable"):
        if faced[index] and facing[index] and width[index] > AWAY:
            line = LineString([wall, across[index]])
            if floor.covers(line):
                return Gap(wall, across[index])
    return None
