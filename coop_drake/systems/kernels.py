"""What a robot computes in one cell, in one compiled call each: governors, readiness, its own state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coop_drake.geometry.polygons import signed_distance
from coop_drake.harmonic_maps.field import velocity_in_field
from coop_drake.jit import compiled
from coop_drake.laws.axis_table import LEAVING_TIME
from coop_drake.laws.governor import (
    VELOCITY_STEP,
    driving_margin,
    energy_margin,
    governed_acceleration,
    governor_velocity,
    steady_clearance,
    tracking_energy,
)
from coop_drake.laws.ppc import (
    SMOOTHING,
    SPEED_LIMIT,
    governed_gains,
    speed_damping,
)
from coop_drake.laws.readiness import (
    axis_arrival,
    axis_ready,
    clearance_margin,
    position_arrival,
)
from coop_drake.tree.arrays import FloatArray

# What a robot computes in one cell, in one compiled call each: governors and readiness.

# The reference governor in one cell: distance to the boundary, harmonic map and law in one call.


@compiled(borrows=True)
def cell_margin(
    edges: FloatArray, stiffness: float, object_state: FloatArray, governor_position: FloatArray
) -> tuple[float, float]:
    """Return Delta E of (15) in one cell, from velocities in steps of ``VELOCITY_STEP``, and d.

    Args:
        edges: Edges of the governed set, shape (edges, 4) [m].
        stiffness: K [1/s^2].
        object_state: Pose and twist of the object, shape (6,).
        governor_position: p_G, shape (2,) [m].

    Returns:
        Delta E [m^2/s^2] and the signed distance of p_G to the boundary of the governed set [m].
    """
    clearance = signed_distance(edges, governor_position[0], governor_position[1])
    x, y = object_state[0] - governor_position[0], object_state[1] - governor_position[1]
    vx = np.rint(object_state[3] / VELOCITY_STEP) * VELOCITY_STEP
    vy = np.rint(object_state[4] / VELOCITY_STEP) * VELOCITY_STEP
    return energy_margin(tracking_energy(x, y, vx, vy, stiffness), clearance, stiffness), clearance


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
    # The desired acceleration, damped near the speed limit, which the speed may approach at the rate zeta.
    vx, vy = object_state[3], object_state[4]
    ax = governed_acceleration(object_state[0], vx, governor_position[0], gains[0], gains[1])
    ay = governed_acceleration(object_state[1], vy, governor_position[1], gains[0], gains[1])
    damping = speed_damping(ax * vx + ay * vy, vx * vx + vy * vy, limit, gains[1])
    command[2], command[3] = ax - damping * vx, ay - damping * vy
    margin, clearance = cell_margin(edges, gains[0], object_state, governor_position)
    driving = driving_margin(margin, clearance, steady_clearance(limit, *gains), gains[0])
    if driving <= 0.0:  # the map is not evaluated in vain
        command[0], command[1] = 0.0, 0.0
        return margin
    vx, vy = velocity_in_field(flat, field, governor_position[0], governor_position[1])
    command[0], command[1] = governor_velocity(vx, vy, driving, gains[0], gains[2], row[SMOOTHING])
    return margin


# One robot's ready report: the conditions of ``coop_drake.laws.readiness`` on object and joints.


class ReadyConditions(NamedTuple):
    """What a robot needs to know in one cell to judge whether it is ready.

    Attributes:
        table: The axes (theta, own joints) in this cell, shape (1 + n, ``LAW_COLUMNS``).
        next_table: The axes in the next cell; not read in the last cell.
        next_edges: Edges of the next cell, shape (edges, 4) [m]; not read in the last cell.
        next_stiffness: K with which the next cell is entered [1/s^2]; not read in the last cell.
        inradius: R of the transition [m].
        goal: Goal position of the object, shape (2,) [m].
        tolerance: Largest distance to it that counts as arrived [m].
        last: Whether this is the last cell.
    """

    table: FloatArray
    next_table: FloatArray
    next_edges: FloatArray
    next_stiffness: float
    inradius: float
    goal: FloatArray
    tolerance: float
    last: bool


def ready_conditions(
    tables: Sequence[FloatArray],
    edges: Sequence[FloatArray],
    governor_rows: Sequence[FloatArray],
    inradii: Sequence[float],
    goal: FloatArray,
    tolerance: float,
) -> list[ReadyConditions]:
    """Return the conditions of every cell.

    Args:
        tables: The axes in every cell.
        edges: Edges of every governed set.
        governor_rows: The governor's row of every cell, see ``governed_gains``.
        inradii: R of every transition [m].
        goal: Goal position of the object, shape (2,) [m].
        tolerance: Largest distance to it that counts as arrived [m].
    """
    count, place = len(tables), np.array(goal, dtype=float)
    following = [*range(1, count), count - 1]
    return [
        ReadyConditions(
            tables[i],
            tables[j],
            edges[j],
            float(governed_gains(governor_rows[j], 0.0)[0]),
            float(inradii[i]),
            place,
            float(tolerance),
            i == j,
        )
        for i, j in enumerate(following)
    ]


def robot_ready(
    known: ReadyConditions, time: float, object_state: FloatArray, robot: FloatArray,
    governor_position: FloatArray,
) -> float:  # fmt: skip
    """Return the margin with which one robot is ready for the next cell, ready if not negative.

    In the last cell it is the margin with which the goal is reached and the motion has ended.

    Args:
        known: The conditions of the current cell.
        time: Time since the current cell was entered [s].
        object_state: Pose and twist of the object, shape (6,).
        robot: (z_k, z_k'), shape (2 (3 + n),).
        governor_position: p_G as the robot keeps it, shape (2,) [m].
    """
    edges, stiffness = known.next_edges, known.next_stiffness
    if known.last:
        distance = np.hypot(*(object_state[:2] - known.goal))
        margin = position_arrival(distance, np.hypot(*object_state[3:5]), known.tolerance)
    else:
        margin, _ = cell_margin(edges, stiffness, object_state, governor_position)
        margin = clearance_margin(margin, stiffness, known.inradius)
    return min(margin, axes_ready(known.table, known.next_table, known.last, time, object_state, robot))


@compiled(borrows=True)
def axes_ready(
    table: FloatArray,
    next_table: FloatArray,
    last: bool,
    time: float,
    object_state: FloatArray,
    robot: FloatArray,
) -> float:
    """Return the margin with which the axes that a robot knows are ready, and the last hand-over is over.

    Args:
        table: The axes (theta, own joints) in this cell, shape (1 + n, ``LAW_COLUMNS``).
        next_table: The axes in the next cell.
        last: Whether this is the last cell.
        time: Time since the current cell was entered [s].
        object_state: Pose and twist of the object, shape (6,).
        robot: (z_k, z_k'), shape (2 (3 + n),).
    """
    n, margin, leaving = table.shape[0] - 1, 1.0, table[0, LEAVING_TIME]
    if not last and leaving > 0.0:
        margin = min(time / leaving - 1.0, 1.0)
    for i in range(1 + n):
        position, rate = object_state[2], object_state[5]
        if i > 0:
            position, rate = robot[2 + i], robot[5 + n + i]
        if last:
            margin = min(margin, axis_arrival(table[i], position, rate))
        else:
            inside, slow = axis_ready(table[i], next_table[i], position, rate)
            margin = min(margin, inside, slow)
    return margin
