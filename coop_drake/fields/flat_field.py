"""The velocity field of a map at a point, in machine code that other compiled code may call."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.evaluation import evaluate_one
from coop_drake.fields.flat_map import FlatMap, centre_of, rounding_of, unflatten
from coop_drake.fields.quadrature import FloatArray
from coop_drake.fields.walls import is_inside, nearest_on_edges

__all__ = ["flat_field", "velocities_in_field", "velocity_in_field"]

_STRAIGHT = 1e-6  # part of the slowdown radius within which the line to a point goal is straight


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
    """Velocity at a point of W [m/s].

    Args:
        flat: The map, from `VelocityField.kernel_arguments` as is the next.
        field: What the field adds to it.
        x: The point [m].
        y: The point [m].
    """
    centre = centre_of(flat)
    x, y = x - centre[0], y - centre[1]
    radius, max_speed, goal = field[0], field[1], field[4:].reshape(((len(field) - 4) // 4, 4))
    gx, gy = nearest_on_edges(goal, x, y)
    remaining = np.hypot(gx - x, gy - y)
    if remaining == 0.0 or is_inside(goal, x, y):
        return 0.0, 0.0
    if len(goal) == 1 and remaining < _STRAIGHT * radius:
        dx, dy = gx - x, gy - y
    else:
        u, v, u_x, u_y, v_x, v_y = evaluate_one(unflatten(flat), x, y, rounding_of(flat))
        du, dv = field[2] - u, field[3] - v
        dx, dy = v_y * du - u_y * dv, u_x * dv - v_x * du
    norm = np.hypot(dx, dy)
    if norm == 0.0:
        return 0.0, 0.0
    speed = max_speed * min(1.0, remaining / radius)
    return speed * dx / norm, speed * dy / norm


@compiled(reassociate=True)
def velocities_in_field(flat: FlatMap, field: FloatArray, points: FloatArray) -> FloatArray:
    """The same at many points (n, 2)."""
    velocities = np.empty((len(points), 2))
    for i in range(len(points)):
        velocities[i, 0], velocities[i, 1] = velocity_in_field(flat, field, points[i, 0], points[i, 1])
    return velocities
