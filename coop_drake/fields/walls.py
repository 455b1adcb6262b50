"""Where a point lies among walls, in compiled code; a wall is four numbers (x0, y0, x1, y1) [m]."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.quadrature import FloatArray

__all__ = ["is_inside", "nearest_on_walls"]


@compiled(reassociate=True)
def is_inside(numbers: FloatArray, first: int, count: int, x: float, y: float) -> bool:
    """Whether a point is inside, by the number of walls that a ray to the right crosses.

    Args:
        numbers: An array that holds the walls of all rings one after the other.
        first: Where the first wall stands in it.
        count: How many there are.
        x: The point [m].
        y: The point [m].
    """
    inside = False
    for e in range(first, first + 4 * count, 4):
        y0, y1 = numbers[e + 1], numbers[e + 3]
        if (y0 > y) != (y1 > y):
            side = (numbers[e + 2] - numbers[e]) * (y - y0) - (x - numbers[e]) * (y1 - y0)
            if (side > 0.0) == (y1 > y0):
                inside = not inside
    return inside


@compiled(reassociate=True)
def nearest_on_walls(numbers: FloatArray, first: int, count: int, x: float, y: float) -> tuple[float, float]:
    """The point of the walls that is nearest to a point; arguments as in `is_inside`."""
    best, bx, by = np.inf, x, y
    for e in range(first, first + 4 * count, 4):
        ax, ay = numbers[e], numbers[e + 1]
        dx, dy = numbers[e + 2] - ax, numbers[e + 3] - ay
        squared = dx * dx + dy * dy
        t = ((x - ax) * dx + (y - ay) * dy) / squared if squared > 0.0 else 0.0
        t = min(1.0, max(0.0, t))
        px, py = ax + t * dx, ay + t * dy
        distance = (px - x) ** 2 + (py - y) ** 2
        if distance < best:
            best, bx, by = distance, px, py
    return bx, by
