"""The reference governor of one cell, compiled: walls, map and law in one call."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.fields.flat_field import velocity_in_field
from coop_drake.geometry.boundary import signed_distance
from coop_drake.laws.kernels import governed_acceleration, governor_velocity
from coop_drake.tree.pose import FloatArray

__all__ = ["VELOCITY_STEP", "cell_margin", "govern"]

#: The energy is computed from a velocity in steps of this size [m/s]. Every robot knows the velocity through
#: its own arm, with its own rounding; in steps they have the same number, and so the same p_G, bit by bit.
VELOCITY_STEP = 2.0**-26


@compiled
def cell_margin(edges: FloatArray, stiffness: float, state: FloatArray, governor: FloatArray) -> float:
    """Return Delta E = (K / 2) d^2 - E of (15) and (16).

    Args:
        edges: Of the governed set, shape (edges, 4) [m].
        stiffness: K [1/s^2].
        state: Pose and twist of the object, shape (6,).
        governor: p_G, shape (2,) [m].
    """
    vx = np.rint(state[3] / VELOCITY_STEP) * VELOCITY_STEP
    vy = np.rint(state[4] / VELOCITY_STEP) * VELOCITY_STEP
    x, y = state[0] - governor[0], state[1] - governor[1]
    energy: float = 0.5 * (vx**2 + vy**2 + stiffness * (x * x + y * y))
    clearance: float = signed_distance(edges, governor[0], governor[1])
    return 0.5 * stiffness * clearance * abs(clearance) - energy


@compiled
def govern(
    gains: FloatArray,
    edges: FloatArray,
    flat: FloatArray,
    field: FloatArray,
    state: FloatArray,
    governor: FloatArray,
    command: FloatArray,
) -> None:
    """Write p_G', then the desired acceleration of L's origin, both of (14), shape (4,) [m/s, m/s^2].

    Args:
        gains: (K, zeta, K_G, c).
        edges: Of the governed set, shape (edges, 4) [m].
        flat: The cell's map, as ``VelocityField.kernel_arguments`` has it.
        field: What the velocity field adds to the map.
        state: Pose and twist of the object, shape (6,).
        governor: p_G, shape (2,) [m].
        command: Receives both.
    """
    governed_acceleration(state, governor, gains[0], gains[1], command[2:])
    margin = cell_margin(edges, gains[0], state, governor)
    if margin <= 0.0:
        command[0], command[1] = 0.0, 0.0
        return
    vx, vy = velocity_in_field(flat, field, governor[0], governor[1])
    governor_velocity(vx, vy, margin, gains[0], gains[2], gains[3], command[:2])
