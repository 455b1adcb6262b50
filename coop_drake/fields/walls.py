"""Where a point lies among walls, in compiled code; a wall is four numbers (x0, y0, x1, y1) [m]."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.distances import nearest_fraction, ray_crosses
from coop_drake.tree.pose import FloatArray


@compiled(reassociate=True)
def is_inside(numbers: FloatArray, first: int, count: int, x: float, y: float) -> bool:
    """Whether a point is inside, by the number of walls that a ray to the right crosses.

    The walls of all rings, so many, stand one after the other in an array, from index ``first`` on.
    """
    inside = False
    for e in range(first, first + 4 * count, 4):
        if ray_crosses(x, y, numbers[e], numbers[e + 1], numbers[e + 2], numbers[e + 3]):
            inside = not inside
    return inside


@compiled(reassociate=True)
def nearest_on_walls(numbers: FloatArray, first: int, count: int, x: float, y: float) -> tuple[float, float]:
    """The point of the walls that is nearest to a point; arguments as in `is_inside`."""
    best, bx, by = np.inf, x, y
    for e in range(first, first + 4 * count, 4):
        x0, y0, x1, y1 = numbers[e], numbers[e + 1], numbers[e + 2], numbers[e + 3]
        t = nearest_fraction(x, y, x0, y0, x1, y1)
        px, py = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
        distance = (px - x) ** 2 + (py - y) ** 2
        if distance < best:
            best, bx, by = distance, px, py
    return bx, by
