"""What a robot computes in one cell, in one compiled call each: governors, readiness, its own state."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt
from typing import NamedTuple

import numpy as np

from coop_drake.geometry.polygons import signed_distance
from coop_drake.harmonic_maps.field import velocity_in_field
from coop_drake.jit import compiled
from coop_drake.laws.axis_table import LEAVING_TIME
from coop_drake.laws.governor import (
    ATTRACTION_RATE,
    VELOCITY_STEP,
    driving_margin,
    energy_margin,
    governed_acceleration,
    governor_velocity,
    steady_clearance,
    tracking_energy,
)
from coop_drake.laws.ppc import (
    GOVERNOR_GAIN,
    SMOOTHING,
    SPEED_LIMIT,
    STIFFNESS,
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


# The nominal governor in one cell: one step of the nominal motion and of p_G, in one call.

NOMINAL_SIZE = 6
"""What the nominal governor shows to other blocks: p^ (2) [m], p^' (2) [m/s], Delta E [m^2/s^2], and how far
p_G can go while a report of now is still used [m]."""

NOTHING = np.empty(0)
"""What stands for it where p_G follows the measured position."""

STATE_SIZE = 6
"""Numbers of its state that change with every step: p^ (2) [m], p^' (2) [m/s], p_G (2) [m]."""


@compiled(borrows=True)
def nominal_margins(
    edges: FloatArray, stiffness: float, nominal: FloatArray, governor: FloatArray
) -> tuple[float, float]:
    """Return Delta E of (15) with p^ in place of p, and d - a, the distance that p_G has left to go.

    p^ is no farther than a = root(2 E / K) from p_G until p_G moves.

    Args:
        edges: Edges of the governed set, shape (edges, 4) [m].
        stiffness: K [1/s^2].
        nominal: p^ and p^', shape (4,) or longer.
        governor: p_G, shape (2,) [m].

    Returns:
        Delta E [m^2/s^2] and d - a [m].
    """
    distance = signed_distance(edges, governor[0], governor[1])
    x, y = nominal[0] - governor[0], nominal[1] - governor[1]
    energy = tracking_energy(x, y, nominal[2], nominal[3], stiffness)
    return energy_margin(energy, distance, stiffness), distance - sqrt(2.0 * energy / stiffness)


@compiled(borrows=True)
def step_nominal(
    row: FloatArray, edges: FloatArray, flat: FloatArray, field: FloatArray, flow: FloatArray,
    period: float, speed: float, pace: float, state: FloatArray, following: FloatArray,
) -> None:  # fmt: skip
    """Write p^, p^' and p_G a period later.

    A step of p_G is at most T times its largest speed, and at most half of d - a.

    Args:
        row: The governor's row, see ``governed_gains``, shape (9,); K does not change at a hand-over.
        edges: Edges of the governed set, shape (edges, 4) [m].
        flat: The cell's map, as ``VelocityField.kernel_arguments`` has it.
        field: What the velocity field adds to the map.
        flow: What ``nominal_flow`` gives.
        period: T [s].
        speed: Largest speed of p_G [m/s].
        pace: Pace of the funnels' clock [-].
        state: p^, p^' and p_G now, shape (6,).
        following: Receives those of the next sample, shape (6,).
    """
    for i in range(2):
        off, rate, governor = state[i] - state[4 + i], state[2 + i], state[4 + i]
        following[i] = governor + flow[0, 0] * off + flow[0, 1] * rate
        following[2 + i] = flow[1, 0] * off + flow[1, 1] * rate
        following[4 + i] = governor
    margin, room = nominal_margins(edges, row[STIFFNESS], state, state[4:])
    if room > 0.0:
        vx, vy = velocity_in_field(flat, field, state[4], state[5])
        vx, vy = governor_velocity(vx, vy, margin, row[STIFFNESS], row[GOVERNOR_GAIN], row[SMOOTHING])
        length, allowed = period * hypot(pace * vx, pace * vy), min(period * speed, 0.5 * room)
        scale = period if length <= allowed else period * allowed / length
        following[4] += scale * (pace * vx)
        following[5] += scale * (pace * vy)


@compiled(borrows=True)
def show_nominal(
    edges: FloatArray, stiffness: float, target: FloatArray, period: float, periods: float, speed: float,
    state: FloatArray, shown: FloatArray,
) -> None:  # fmt: skip
    """Write what ``NOMINAL_SIZE`` lists.

    The field (13) moves p_G by at most ``ATTRACTION_RATE`` times its distance from the target, which with
    every step can grow by as much.

    Args:
        edges: Edges of the governed set, shape (edges, 4) [m].
        stiffness: K [1/s^2].
        target: Where p_G goes in this cell, shape (2,) [m].
        period: T [s].
        periods: For how many periods a report is used [-].
        speed: Largest speed of p_G [m/s].
        state: p^, p^' and p_G, shape (6,).
        shown: Receives the numbers, shape (6,).
    """
    for i in range(4):
        shown[i] = state[i]
    shown[4], _ = nominal_margins(edges, stiffness, state, state[4:])
    distance = np.hypot(state[4] - target[0], state[5] - target[1])
    growth = (1.0 + ATTRACTION_RATE * period) ** periods - 1.0
    shown[5] = min(periods * period * speed, distance * growth)


# One robot's ready report: the conditions of ``coop_drake.laws.readiness`` on object and joints.


@compiled(borrows=True)
def nominal_ready(
    next_edges: FloatArray, next_stiffness: float, nominal: FloatArray, governor: FloatArray
) -> float:
    """Return the margin with which the nominal motion stays in the next region until the switch, at most 1.

    The room d - a there may shrink by twice the way of p_G, until a report of now is no longer used.

    Args:
        next_edges: Edges of the next governed set, shape (edges, 4) [m].
        next_stiffness: K in the next cell [1/s^2].
        nominal: What ``show_nominal`` writes.
        governor: p_G, shape (2,) [m].
    """
    _, room = nominal_margins(next_edges, next_stiffness, nominal, governor)
    needed = 2.0 * nominal[5]
    return (room - needed) / max(abs(room), needed, 1e-9)


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
    governor_position: FloatArray, nominal: FloatArray,
) -> float:  # fmt: skip
    """Return the margin with which one robot is ready for the next cell, ready if not negative.

    In the last cell it is the margin with which the goal is reached and the motion has ended; where a nominal
    motion leads, see ``robot_arrived`` instead.

    Args:
        known: The conditions of the current cell.
        time: Time since the current cell was entered [s].
        object_state: Pose and twist of the object, shape (6,).
        robot: (z_k, z_k'), shape (2 (3 + n),).
        governor_position: p_G as the robot keeps it, shape (2,) [m].
        nominal: What ``show_nominal`` writes, by which the position is judged then, shape (6,); or of shape
            (0,) where p_G follows what is measured.
    """
    edges, stiffness = known.next_edges, known.next_stiffness
    if nominal.size:
        margin = nominal_ready(edges, stiffness, nominal, governor_position)
    elif known.last:
        distance = np.hypot(*(object_state[:2] - known.goal))
        margin = position_arrival(distance, np.hypot(*object_state[3:5]), known.tolerance)
    else:
        margin, _ = cell_margin(edges, stiffness, object_state, governor_position)
        margin = clearance_margin(margin, stiffness, known.inradius)
    return min(margin, axes_ready(known.table, known.next_table, known.last, time, object_state, robot))


@compiled(borrows=True)
def robot_arrived(
    table: FloatArray, goal: FloatArray, tolerance: float, axes_led: bool, object_state: FloatArray,
    robot: FloatArray, nominal: FloatArray, arrival: float,
) -> float:  # fmt: skip
    """Return the margin with which a sampled robot has arrived in the last cell, arrived if not negative.

    It measures that it has, and where nominal motions lead, they are at rest at the goal, too.

    Args:
        table: The axes (theta, own joints) in this cell.
        goal: Goal position, shape (2,) [m].
        tolerance: Tolerance of the nominal position [m].
        axes_led: Whether ``object_state`` and ``robot`` have the angles and rates of nominal axes.
        object_state: Pose and twist of the object, shape (6,).
        robot: The robot's own state.
        nominal: What ``show_nominal`` writes, shape (6,), or shape (0,) where no nominal motion leads.
        arrival: What ``arrival_margin`` gives.
    """
    margin = arrival
    if nominal.size:
        distance = np.hypot(nominal[0] - goal[0], nominal[1] - goal[1])
        margin = min(margin, position_arrival(distance, np.hypot(nominal[2], nominal[3]), tolerance))
    if axes_led:
        # With ``True`` the axes are judged at the goal: no next table and no time are read.
        margin = min(margin, axes_ready(table, table, True, 0.0, object_state, robot))
    return margin


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
