"""Where a point is among the walls, in machine code."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.quadrature import FloatArray

__all__ = ["is_inside", "nearest_on_edges"]


@compiled(reassociate=True)
def is_inside(edges: FloatArray, x: float, y: float) -> bool:
    """Whether a point is inside by the crossing number of all rings."""
    inside = False
    for e in range(len(edges)):
        y0, y1 = edges[e, 1], edges[e, 3]
        if (y0 > y) != (y1 > y):
            side = (edges[e, 2] - edges[e, 0]) * (y - y0) - (x - edges[e, 0]) * (y1 - y0)
            if (side > 0.0) == (y1 > y0):
                inside = not inside
    return inside


@compiled(reassociate=True)
def nearest_on_edges(edges: FloatArray, x: float, y: float) -> tuple[float, float]:
    """The nearest point of the boundary."""
    best, bx, by = np.inf, x, y
    for e in range(len(edges)):
        dx, dy = edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1]
        squared = dx * dx + dy * dy
        t = ((x - edges[e, 0]) * dx + (y - edges[e, 1]) * dy) / squared if squared > 0.0 else 0.0
        t = min(1.0, max(0.0, t))
        px, py = edges[e, 0] + t * dx, edges[e, 1] + t * dy
        distance = (px - x) ** 2 + (py - y) ** 2
        if distance < best:
            best, bx, by = distance, px, py
    return bx, by
