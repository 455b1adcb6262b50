"""One robot's ready report: the conditions of ``coop_drake.laws.readiness`` on object and joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import LEAVING_TIME
from coop_drake.laws.hand_over import governed_gains
from coop_drake.laws.readiness import (
    axis_arrival,
    axis_ready,
    clearance_margin,
    hand_over_margin,
    position_arrival,
)
from coop_drake.systems.governor_kernels import cell_margin
from coop_drake.systems.nominal_kernels import nominal_ready
from coop_drake.tree.pose import FloatArray

__all__ = ["ReadyConditions", "ready_conditions", "robot_arrived", "robot_ready", "robot_ready_along"]


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


@compiled(borrows=True)
def robot_ready(
    table: FloatArray,
    next_table: FloatArray,
    next_edges: FloatArray,
    next_stiffness: float,
    inradius: float,
    goal: FloatArray,
    tolerance: float,
    last: bool,
    time: float,
    object_state: FloatArray,
    robot: FloatArray,
    governor_position: FloatArray,
) -> float:
    """Return the margin with which one robot is ready for the next cell, ready if not negative.

    In the last cell it is the margin with which the goal is reached and the motion has ended.

    Args:
        table: With the next seven the ``ReadyConditions`` of the current cell.
        next_table: The axes in the next cell.
        next_edges: Edges of the next cell.
        next_stiffness: K with which it is entered.
        inradius: R of the transition.
        goal: Goal position.
        tolerance: Tolerance of the goal position.
        last: Whether this is the last cell.
        time: Time since the current cell was entered [s].
        object_state: Pose and twist of the object, shape (6,).
        robot: (z_k, z_k'), shape (2 (3 + n),).
        governor_position: p_G as the robot keeps it, shape (2,) [m].
    """
    if last:
        distance = np.hypot(object_state[0] - goal[0], object_state[1] - goal[1])
        speed = np.hypot(object_state[3], object_state[4])
        margin = position_arrival(distance, speed, tolerance)
    else:
        energy_margin = cell_margin(next_edges, next_stiffness, object_state, governor_position)
        margin = clearance_margin(energy_margin, next_stiffness, inradius)
    return min(margin, axes_ready(table, next_table, last, time, object_state, robot))


@compiled(borrows=True)
def robot_ready_along(
    table: FloatArray, next_table: FloatArray, next_edges: FloatArray, next_stiffness: float,
    inradius: float, goal: FloatArray, tolerance: float, last: bool, time: float, object_state: FloatArray,
    robot: FloatArray, governor_position: FloatArray, nominal: FloatArray,
) -> float:  # fmt: skip
    """Return ``robot_ready`` where the position is judged by its nominal motion, see ``laws/nominal.py``.

    Args:
        table: This and the next eleven arguments are those of ``robot_ready``; see there.
        next_table: The axes in the next cell.
        next_edges: Edges of the next governed set.
        next_stiffness: K with which it is entered.
        inradius: R of the transition; not used here.
        goal: Goal position; not used here.
        tolerance: Tolerance of the nominal position; not used here.
        last: Whether this is the last cell; it is not, see ``robot_arrived``.
        time: Time since the current cell was entered [s].
        object_state: Pose and twist of the object.
        robot: The robot's own state.
        governor_position: p_G.
        nominal: What ``show_nominal`` writes, shape (6,).
    """
    margin = nominal_ready(next_edges, next_stiffness, nominal, governor_position)
    return min(margin, axes_ready(table, next_table, last, time, object_state, robot))


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
    margin, n = arrival, table.shape[0] - 1
    if nominal.size:
        distance = np.hypot(nominal[0] - goal[0], nominal[1] - goal[1])
        margin = min(margin, position_arrival(distance, np.hypot(nominal[2], nominal[3]), tolerance))
    if axes_led:
        for i in range(1 + n):
            position, rate = object_state[2], object_state[5]
            if i > 0:
                position, rate = robot[2 + i], robot[5 + n + i]
            margin = min(margin, axis_arrival(table[i], position, rate))
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
    n = table.shape[0] - 1
    margin = 1.0 if last else hand_over_margin(time, table[0, LEAVING_TIME])
    for i in range(1 + n):
        position, rate = object_state[2], object_state[5]
        if i > 0:
            position, rate = robot[2 + i], robot[5 + n + i]
        if last:
            margin = min(margin, axis_arrival(table[i], position, rate))
        else:
            margin = min(margin, axis_ready(table[i], next_table[i], position, rate))
    return margin
