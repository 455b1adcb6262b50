"""The velocity field of a map at a point, as a compiled function that other compiled code may call."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.evaluation import evaluate_one
from coop_drake.fields.flat_map import FlatMap, centre_of
from coop_drake.fields.walls import is_inside, nearest_on_walls
from coop_drake.tree.pose import FloatArray

_STRAIGHT = 1e-6
"""Fraction of the slowdown radius within which the way to a point goal is taken as straight: closer still,
the difference of the images is mostly rounding [-]."""
_EDGES = 4
"""Numbers in a flat field before the goal's edges: slowdown radius, largest speed, the goal's image."""


def flat_field(edges: FloatArray, image: FloatArray, radius: float, max_speed: float) -> FloatArray:
    """What a field adds to its map, as one array.

    Args:
        edges: The goal's edges, rows (x0, y0, x1, y1) relative to the map's centre [m], shape (n, 4); for a
            point, one edge of no length.
        image: q_d, the goal's image, shape (2,).
        radius: Where slowing down begins [m].
        max_speed: Largest magnitude [m/s].
    """
    return np.concatenate(([radius, max_speed], image, edges.reshape(-1)))


@compiled(reassociate=True)
def velocity_in_field(flat: FlatMap, field: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Velocity at a point of W [m], eq. (13) [m/s].

    The first two arguments are `VelocityField.kernel_arguments`: the map, and what the field adds to it.
    """
    centre = centre_of(flat)
    x, y = x - centre[0], y - centre[1]
    radius, max_speed, edges = field[0], field[1], (len(field) - _EDGES) // 4
    gx, gy = nearest_on_walls(field, _EDGES, edges, x, y)
    remaining = np.sqrt((gx - x) ** 2 + (gy - y) ** 2)
    if remaining == 0.0 or is_inside(field, _EDGES, edges, x, y):
        return 0.0, 0.0
    if edges == 1 and remaining < _STRAIGHT * radius:
        dx, dy = gx - x, gy - y
    else:
        u, v, u_x, u_y, v_x, v_y = evaluate_one(flat, x, y)
        du, dv = field[2] - u, field[3] - v
        dx, dy = v_y * du - u_y * dv, u_x * dv - v_x * du
    norm = np.hypot(dx, dy)
    if norm == 0.0:
        return 0.0, 0.0
    speed = max_speed * min(1.0, remaining / radius)
    return speed * dx / norm, speed * dy / norm


@compiled(reassociate=True)
def velocities_in_field(flat: FlatMap, field: FloatArray, points: FloatArray) -> FloatArray:
    """Velocities at many points of W, shape (n, 2) [m] -> (n, 2) [m/s]."""
    velocities = np.empty((len(points), 2))
    for i in range(len(points)):
        velocities[i, 0], velocities[i, 1] = velocity_in_field(flat, field, points[i, 0], points[i, 1])
    return velocities
