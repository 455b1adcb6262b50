"""The ready reports, compiled; what they compute is explained in control/ready.py."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.boundary import signed_distance
from coop_drake.laws.kernels import track_row
from coop_drake.laws.ready import CLEARANCE_FRACTION, EROSION, RATE_TOLERANCE, SPEED_TOLERANCE
from coop_drake.tree.pose import FloatArray

__all__ = [
    "axis_ready",
    "axis_rests",
    "position_arrived",
    "position_ready",
    "robot_arrival",
    "robot_ready",
]


@compiled
def position_ready(
    next_edges: FloatArray, next_stiffness: float, inradius: float, state: FloatArray, governor: FloatArray
) -> float:
    """Return ``clearance_margin`` of the next cell.

    Args:
        next_edges: Of the next cell, shape (edges, 4) [m].
        next_stiffness: K of the next cell [1/s^2].
        inradius: R of the present transition [m].
        state: Pose and twist of the object, shape (6,).
        governor: p_G, shape (2,) [m].
    """
    x, y = state[0] - governor[0], state[1] - governor[1]
    energy = 0.5 * (state[3] ** 2 + state[4] ** 2 + next_stiffness * (x * x + y * y))
    clearance = signed_distance(next_edges, governor[0], governor[1])
    margin = 0.5 * next_stiffness * clearance * abs(clearance) - energy
    floor = 0.5 * next_stiffness * CLEARANCE_FRACTION * inradius * abs(CLEARANCE_FRACTION * inradius)
    return (margin - floor) / max(abs(margin), floor)


@compiled
def axis_ready(row: FloatArray, next_row: FloatArray, position: float, rate: float) -> float:
    """Return the smaller of ``interval_margin`` and ``funnel_margin`` of one axis from its rows of tables."""
    energy, bound = track_row(next_row, 0.0, position, rate)[1], next_row[9]
    return min(_axis_inside(row, position), (bound - energy) / max(energy, bound))


@compiled
def position_arrived(goal: FloatArray, tolerance: float, state: FloatArray) -> float:
    """Return the part of ``arrival_margin`` that speaks of the object's position."""
    distance = np.hypot(state[0] - goal[0], state[1] - goal[1])
    speed = np.hypot(state[3], state[4])
    return min(1.0 - distance / ((1.0 - EROSION) * tolerance), 1.0 - speed / SPEED_TOLERANCE)


@compiled
def axis_rests(row: FloatArray, position: float, rate: float) -> float:
    """Return the part of ``arrival_margin`` that speaks of one axis."""
    return min(_axis_inside(row, position), 1.0 - abs(rate) / RATE_TOLERANCE)


@compiled
def _axis_inside(row: FloatArray, position: float) -> float:
    half = 0.5 * (row[3] - row[2]) * (1.0 - 2.0 * EROSION)
    return 1.0 - abs(position - 0.5 * (row[2] + row[3])) / half


@compiled
def robot_ready(
    table: FloatArray,
    next_table: FloatArray,
    next_edges: FloatArray,
    next_stiffness: float,
    inradius: float,
    thing: FloatArray,
    state: FloatArray,
    governor: FloatArray,
) -> float:
    """Return ``ready_margin`` of one robot.

    Args:
        table: Laws of the axes (theta, own joints) in the current cell.
        next_table: The same in the next one.
        next_edges: Of the next cell, shape (edges, 4) [m].
        next_stiffness: K of the next cell [1/s^2].
        inradius: R of the present transition [m].
        thing: Pose and twist of the object, shape (6,).
        state: (z_k, z_k'), shape (2 (3 + n),).
        governor: p_G as the robot keeps it, shape (2,) [m].
    """
    n = table.shape[0] - 1
    margin = position_ready(next_edges, next_stiffness, inradius, thing, governor)
    margin = min(margin, axis_ready(table[0], next_table[0], thing[2], thing[5]))
    for i in range(n):
        margin = min(margin, axis_ready(table[1 + i], next_table[1 + i], state[3 + i], state[6 + n + i]))
    return margin


@compiled
def robot_arrival(
    table: FloatArray, goal: FloatArray, tolerance: float, thing: FloatArray, state: FloatArray
) -> float:
    """Return ``arrival_margin`` of one robot.

    Args:
        table: Laws of the axes (theta, own joints) in the last cell.
        goal: Where the object shall end, shape (2,) [m].
        tolerance: How close to it counts as arrived [m].
        thing: Pose and twist of the object, shape (6,).
        state: (z_k, z_k'), shape (2 (3 + n),).
    """
    n = table.shape[0] - 1
    margin = min(position_arrived(goal, tolerance, thing), axis_rests(table[0], thing[2], thing[5]))
    for i in range(n):
        margin = min(margin, axis_rests(table[1 + i], state[3 + i], state[6 + n + i]))
    return margin
