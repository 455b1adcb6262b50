"""The reference governor in one cell: distance to the boundary, harmonic map and law in one call."""

from __future__ import annotations

from coop_drake.geometry.polygons import signed_distance
from coop_drake.harmonic_maps.field import velocity_in_field
from coop_drake.jit import compiled
from coop_drake.laws.governor import (
    driving_margin,
    governed_acceleration,
    governor_velocity,
    object_energy_margin,
    steady_clearance,
)
from coop_drake.laws.hand_over import SMOOTHING, SPEED_LIMIT, governed_gains
from coop_drake.laws.speed_limit import speed_damping
from coop_drake.tree.pose import FloatArray

__all__ = ["accelerate_object", "cell_margin", "govern"]


@compiled(borrows=True)
def cell_margin(
    edges: FloatArray, stiffness: float, object_state: FloatArray, governor_position: FloatArray
) -> float:
    """Return ``object_energy_margin`` in one cell [m^2/s^2].

    Args:
        edges: Edges of the governed set, shape (edges, 4) [m].
        stiffness: K [1/s^2].
        object_state: Pose and twist of the object, shape (6,).
        governor_position: p_G, shape (2,) [m].
    """
    clearance = signed_distance(edges, governor_position[0], governor_position[1])
    return object_energy_margin(object_state, governor_position, clearance, stiffness)


@compiled(borrows=True)
def accelerate_object(
    gains: tuple[float, float, float],
    speed_limit: float,
    object_state: FloatArray,
    governor_position: FloatArray,
    acceleration: FloatArray,
) -> None:
    """Write ``governed_acceleration`` of both coordinates with the damping that keeps the speed limit.

    The rate at which the speed may approach its limit is zeta.

    Args:
        gains: K, zeta and K_G now.
        speed_limit: Largest speed of the object's origin, infinity for none [m/s].
        object_state: Pose and twist of the object, shape (6,).
        governor_position: p_G, shape (2,) [m].
        acceleration: Receives both coordinates, shape (2,) [m/s^2].
    """
    vx, vy = object_state[3], object_state[4]
    ax = governed_acceleration(object_state[0], vx, governor_position[0], gains[0], gains[1])
    ay = governed_acceleration(object_state[1], vy, governor_position[1], gains[0], gains[1])
    damping = speed_damping(ax * vx + ay * vy, vx * vx + vy * vy, speed_limit, gains[1])
    acceleration[0], acceleration[1] = ax - damping * vx, ay - damping * vy


@compiled(borrows=True)
def govern(
    row: FloatArray,
    edges: FloatArray,
    flat: FloatArray,
    field: FloatArray,
    time: float,
    object_state: FloatArray,
    governor_position: FloatArray,
    command: FloatArray,
) -> float:
    """Write p_G', then the desired acceleration of L's origin, both of (14), and return Delta E of (15).

    Args:
        row: The governor's row, see ``governed_gains``, shape (9,).
        edges: Edges of the governed set, shape (edges, 4) [m].
        flat: The cell's map, as ``VelocityField.kernel_arguments`` has it.
        field: What the velocity field adds to the map.
        time: Time since the cell was entered [s].
        object_state: Pose and twist of the object, shape (6,).
        governor_position: p_G, shape (2,) [m].
        command: Receives both, shape (4,) [m/s, m/s^2].

    Returns:
        Delta E [m^2/s^2].
    """
    gains, limit = governed_gains(row, time), row[SPEED_LIMIT]
    accelerate_object(gains, limit, object_state, governor_position, command[2:])
    clearance = signed_distance(edges, governor_position[0], governor_position[1])
    margin = object_energy_margin(object_state, governor_position, clearance, gains[0])
    driving = driving_margin(margin, clearance, steady_clearance(limit, *gains), gains[0])
    if driving <= 0.0:  # the map is not evaluated in vain
        command[0], command[1] = 0.0, 0.0
        return margin
    vx, vy = velocity_in_field(flat, field, governor_position[0], governor_position[1])
    command[0], command[1] = governor_velocity(vx, vy, driving, gains[0], gains[2], row[SMOOTHING])
    return margin
