"""Funnel and gains of the axes of one cell as a table of numbers, a row for each axis."""

from __future__ import annotations

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.gains import TransitionGains
from coop_drake.laws.ppc import (
    Funnel,
    axis_bounds,
    fading,
    ramped_gain,
    speed_damping,
    track_axis,
)
from coop_drake.tree.arrays import FloatArray

# Funnel and gains of every axis of one cell as a table of numbers, one row for each axis.
#
# Compiled code reads the table, because handing over one array is much quicker than handing over ten.

LAW_COLUMNS = 17
"""Columns of a table: slice and goal interval [rad or m], lambda [1/s], 1 where the funnel is quintic and 0
where it is not, kappa [rad^2/s^2 or m^2/s^2], k1, k2 and mu [1/s], the smallest distance to a bound over the
funnel's width [-], the time T in which the commands of the last cell fade [s], the largest V with which the
cell may be entered, and the time after which it may be left [s]. The last columns are the limit of the axis's
rate, infinity for none [rad/s or m/s], g, the rate at which the axis may approach it [1/s], and the limit of
its acceleration, infinity for none."""

SLICE_LOWER, SLICE_UPPER, GOAL_LOWER, GOAL_UPPER, DECAY_RATE, QUINTIC = range(6)
LOG_GAIN, POSITION_GAIN, RATE_GAIN, RAMP_RATE, SATURATION, FADING_TIME, ENERGY_BOUND = range(6, 13)
LEAVING_TIME, RATE_LIMIT, LIMIT_GAIN, ACCELERATION_LIMIT = range(13, LAW_COLUMNS)
"""The columns by name, in this order."""


def axis_table(funnel: Funnel, gains: TransitionGains) -> FloatArray:
    """Return the table of some axes, shape (m, ``LAW_COLUMNS``).

    Args:
        funnel: Funnels of m axes.
        gains: Gains, those of each axis of shape (m,).
    """
    table = np.empty((funnel.goal_lower.size, LAW_COLUMNS))
    for i, row in enumerate(table):
        write_row(
            row,
            (funnel.slice_lower[i], funnel.slice_upper[i], funnel.goal_lower[i], funnel.goal_upper[i]),
            (funnel.decay_rate[i], gains.log_gain[i], gains.energy_bound[i]),
            (gains.position_gain, gains.rate_gain, gains.ramp_rate, gains.saturation, gains.hand_over_time),
            funnel.shape == "quintic",
            gains.limits_of(i),
        )
    return table


def write_row(
    row: FloatArray,
    intervals: tuple[float, float, float, float],
    scheduled: tuple[float, float, float],
    gains: tuple[float, float, float, float, float],
    quintic: bool,
    limits: tuple[float, float, float],
) -> None:
    """Write one row of a table, of an axis that leaves the cell by its V.

    Args:
        row: Receives the numbers, shape (``LAW_COLUMNS``,).
        intervals: Slice and goal interval [rad or m].
        scheduled: lambda, kappa and the largest V, as ``scheduled_axis`` returns them.
        gains: k1, k2 and mu [1/s], the smallest distance to a bound over the width [-], and T [s].
        quintic: Whether the funnel is quintic.
        limits: Largest rate of the axis [rad/s or m/s], g [1/s] and largest acceleration [rad/s^2 or
            m/s^2]; infinity for no limit.
    """
    row[SLICE_LOWER], row[SLICE_UPPER], row[GOAL_LOWER], row[GOAL_UPPER] = intervals
    row[DECAY_RATE], row[LOG_GAIN], row[ENERGY_BOUND] = scheduled
    row[POSITION_GAIN], row[RATE_GAIN], row[RAMP_RATE], row[SATURATION], row[FADING_TIME] = gains
    row[QUINTIC] = 1.0 if quintic else 0.0
    row[RATE_LIMIT], row[LIMIT_GAIN], row[ACCELERATION_LIMIT] = limits
    row[LEAVING_TIME] = row[FADING_TIME]


@compiled(borrows=True)
def bounds_of(row: FloatArray, time: float) -> tuple[float, float, float, float, float, float]:
    """Return ``axis_bounds`` of one axis from its row, ``time`` [s] after the cell was entered."""
    return axis_bounds(
        time, row[SLICE_LOWER], row[SLICE_UPPER], row[GOAL_LOWER], row[GOAL_UPPER], row[DECAY_RATE],
        row[QUINTIC] != 0.0,
    )  # fmt: skip


@compiled(borrows=True)
def gains_of(row: FloatArray, time: float) -> tuple[float, float, float, float, float]:
    """Return the gains of one axis as ``track_axis`` takes them: kappa, k1, k1', k2 and the saturation."""
    k1, k1_dot = ramped_gain(time, row[POSITION_GAIN], row[RAMP_RATE])
    return row[LOG_GAIN], k1, k1_dot, row[RATE_GAIN], row[SATURATION]


@compiled(borrows=True)
def track_row(
    row: FloatArray, time: float, position: float, rate: float, pace: float = 1.0, pace_rate: float = 0.0
) -> tuple[float, float]:
    """Return ``track_axis`` of one axis from its row, whose funnel moves by a clock that may slow down.

    With tau' = ``pace`` and tau'' = ``pace_rate``, a bound rho(tau) has the rate rho' tau' and the
    acceleration rho'' tau'^2 + rho' tau''.

    Args:
        row: The axis, shape (``LAW_COLUMNS``,).
        time: tau, the clock's time since the cell was entered [s].
        position: x [rad or m].
        rate: x' [rad/s or m/s].
        pace: tau' [-].
        pace_rate: tau'' [1/s].
    """
    lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration = bounds_of(row, time)
    kappa, k1, k1_dot, k2, saturation = gains_of(row, time)
    bounds = (
        lower, upper, lower_rate * pace, upper_rate * pace,
        lower_acceleration * pace * pace + lower_rate * pace_rate,
        upper_acceleration * pace * pace + upper_rate * pace_rate,
    )  # fmt: skip
    return track_axis(position, rate, bounds, (kappa, k1, k1_dot * pace, k2, saturation))


def funnel_acceleration(
    position: FloatArray, rate: FloatArray, funnel: Funnel, time: float, gains: TransitionGains
) -> FloatArray:
    """Return the acceleration of ``track_row`` for every axis, shape (m,) [rad/s^2 or m/s^2].

    Args:
        position: x of every axis, shape (m,) [rad or m].
        rate: x' of every axis, shape (m,).
        funnel: Funnels of the axes.
        time: Time since the cell was entered [s].
        gains: Gains of the transition.
    """
    rows = zip(axis_table(funnel, gains), position, rate, strict=True)
    return np.array([track_row(row, float(time), x, v)[0] for row, x, v in rows])


@compiled(borrows=True)
def track_axes(
    table: FloatArray,
    time: float,
    clock: FloatArray,
    jumps: FloatArray,
    object_state: FloatArray,
    robot: FloatArray,
    acceleration: FloatArray,
) -> None:
    """Write the desired accelerations of the object's angle and of one robot's joints.

    Each is that of ``track_row``, plus the jump at the switch times ``fading``, within the limits of the
    axis, see ``limited_row``. While a jump delta fades,
    V' <= -kappa k1 s^2 - k2 (x' - v)^2 + |delta| f |x' - v| <= delta^2 f^2 / (4 k2): V grows by at most
    delta^2 T / (8 k2) in all, so that no axis leaves its funnel whatever the jump.

    Args:
        table: The axes (theta, q_k), shape (1 + n, ``LAW_COLUMNS``).
        time: Time since the cell was entered [s].
        clock: The funnels' clock: its lag [s], its pace [-] and the derivative of the pace [1/s], shape (3,).
        jumps: What ``write_jumps`` gave at the switch, shape (1 + n,) [rad/s^2 or m/s^2].
        object_state: Pose and twist of the object, shape (6,).
        robot: (z_k, z_k'), shape (2 (3 + n),); not read where the robot has no joints.
        acceleration: Receives theta'' and q_k'', shape (1 + n,) [rad/s^2 or m/s^2].
    """
    n, left = table.shape[0] - 1, fading(time, table[0, FADING_TIME])
    for i in range(1 + n):
        x, rate = object_state[2], object_state[5]
        if i > 0:
            x, rate = robot[2 + i], robot[5 + n + i]
        asked = track_row(table[i], time - clock[0], x, rate, clock[1], clock[2])[0] + left * jumps[i]
        acceleration[i] = limited_row(table[i], asked, rate)


@compiled(borrows=True)
def limited_row(row: FloatArray, acceleration: float, rate: float) -> float:
    """Return an acceleration that keeps the limits of the axis [rad/s^2 or m/s^2].

    It is cut off at the limit of the acceleration, and damped near that of the rate. The damping never asks
    for more: while the rate is below its limit it takes away from an acceleration, and turns none round.

    Args:
        row: The axis, shape (``LAW_COLUMNS``,).
        acceleration: What the funnel's law and the hand-over ask for [rad/s^2 or m/s^2].
        rate: x' [rad/s or m/s].
    """
    most = row[ACCELERATION_LIMIT]
    asked: float = min(max(acceleration, -most), most)
    return asked - speed_damping(asked * rate, rate * rate, row[RATE_LIMIT], row[LIMIT_GAIN]) * rate


@compiled(borrows=True)
def write_jumps(
    table: FloatArray,
    next_table: FloatArray,
    time: float,
    clock: FloatArray,
    object_state: FloatArray,
    robot: FloatArray,
    jumps: FloatArray,
) -> None:
    """Write by how much the accelerations of ``track_axes`` would jump if the next cell were entered now.

    Limits do not count: they are the same in all cells, and act on the sum of law and fading jump.

    Args:
        table: The axes in the current cell, whose hand-over is over, shape (1 + n, ``LAW_COLUMNS``).
        next_table: The axes in the next cell.
        time: Time since the current cell was entered [s].
        clock: The funnels' clock, as in ``track_axes``, shape (3,).
        object_state: Pose and twist of the object, shape (6,).
        robot: (z_k, z_k'), shape (2 (3 + n),); not read where the robot has no joints.
        jumps: Receives the law of the current cell less that of the next, shape (1 + n,).
    """
    n = table.shape[0] - 1
    for i in range(1 + n):
        x, rate = object_state[2], object_state[5]
        if i > 0:
            x, rate = robot[2 + i], robot[5 + n + i]
        jumps[i] = switch_jump(table[i], next_table[i], time - clock[0], x, rate, clock[1], clock[2])


@compiled(borrows=True)
def switch_jump(
    row: FloatArray, next_row: FloatArray, time: float, position: float, rate: float,
    pace: float = 1.0, pace_rate: float = 0.0,
) -> float:  # fmt: skip
    """Return by how much the acceleration of an axis jumps if the next cell is entered [rad/s^2 or m/s^2].

    It is the law of its cell less that of the next one.

    Args:
        row: The axis in its cell, a row of an ``axis_table``.
        next_row: The axis in the next cell.
        time: With the next four as in ``track_row``.
        position: x [rad or m].
        rate: x' [rad/s or m/s].
        pace: tau' [-].
        pace_rate: tau'' [1/s].
    """
    now = track_row(row, time, position, rate, pace, pace_rate)[0]
    return now - track_row(next_row, 0.0, position, rate, pace, pace_rate)[0]


def first_jumps(table: FloatArray, start: FloatArray | None) -> FloatArray:
    """Return the jumps at the beginning, from no acceleration to that of the first cell's law, shape (m,).

    Args:
        table: The axes in the first cell, shape (m, ``LAW_COLUMNS``).
        start: Where they rest at the beginning, shape (m,); None for no jumps.
    """
    if start is None:
        return np.zeros(len(table))
    return np.array([-track_row(row, 0.0, x, 0.0)[0] for row, x in zip(table, start, strict=True)])


def write_bounds(table: FloatArray, time: float, bounds: FloatArray) -> None:
    """Write the lower, then the upper funnel bounds of all axes, shape (2 m,) [rad or m]."""
    m = table.shape[0]
    for i in range(m):
        bounds[i], bounds[m + i] = bounds_of(table[i], time)[:2]
