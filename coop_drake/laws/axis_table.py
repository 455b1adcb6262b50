"""Funnel and gains of every axis of one cell as a table of numbers, one row for each axis.

Compiled code reads the table, because handing over one array is much quicker than handing over ten.
"""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.funnels import Funnel, axis_bounds
from coop_drake.laws.gains import TransitionGains
from coop_drake.laws.ppc import ramped_gain, track_axis
from coop_drake.tree.pose import FloatArray

__all__ = [
    "ENERGY_BOUND",
    "GOAL_LOWER",
    "GOAL_UPPER",
    "LAW_COLUMNS",
    "LOG_GAIN",
    "axis_table",
    "bounds_of",
    "funnel_acceleration",
    "track_axes",
    "track_row",
    "write_bounds",
    "write_row",
]

LAW_COLUMNS = 12
"""Columns of a table: slice and goal interval [rad or m], lambda [1/s], 1 where the funnel is quintic and 0
where it is not, kappa [rad^2/s^2 or m^2/s^2], k1, k2 and mu [1/s], the smallest distance to a bound over the
funnel's width [-], and the largest V with which the cell may be entered."""

SLICE_LOWER, SLICE_UPPER, GOAL_LOWER, GOAL_UPPER, DECAY_RATE, QUINTIC = range(6)
LOG_GAIN, POSITION_GAIN, RATE_GAIN, RAMP_RATE, SATURATION, ENERGY_BOUND = range(6, LAW_COLUMNS)
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
            (gains.position_gain, gains.rate_gain, gains.ramp_rate, gains.saturation),
            funnel.shape == "quintic",
        )
    return table


@compiled
def write_row(
    row: FloatArray,
    intervals: tuple[float, float, float, float],
    scheduled: tuple[float, float, float],
    gains: tuple[float, float, float, float],
    quintic: bool,
) -> None:
    """Write one row of a table.

    Args:
        row: Receives the numbers, shape (``LAW_COLUMNS``,).
        intervals: Slice and goal interval [rad or m].
        scheduled: lambda, kappa and the largest V, as ``scheduled_axis`` returns them.
        gains: k1, k2 and mu [1/s], and the smallest distance to a bound over the width [-].
        quintic: Whether the funnel is quintic.
    """
    row[SLICE_LOWER], row[SLICE_UPPER], row[GOAL_LOWER], row[GOAL_UPPER] = intervals
    row[DECAY_RATE], row[LOG_GAIN], row[ENERGY_BOUND] = scheduled
    row[POSITION_GAIN], row[RATE_GAIN], row[RAMP_RATE], row[SATURATION] = gains
    row[QUINTIC] = 1.0 if quintic else 0.0


@compiled
def bounds_of(row: FloatArray, time: float) -> tuple[float, float, float, float, float, float]:
    """Return ``axis_bounds`` of one axis from its row, ``time`` [s] after the cell was entered."""
    return axis_bounds(
        time, row[SLICE_LOWER], row[SLICE_UPPER], row[GOAL_LOWER], row[GOAL_UPPER], row[DECAY_RATE],
        row[QUINTIC] != 0.0,
    )  # fmt: skip


@compiled
def track_row(row: FloatArray, time: float, position: float, rate: float) -> tuple[float, float]:
    """Return ``track_axis`` of one axis from its row.

    Args:
        row: The axis, shape (``LAW_COLUMNS``,).
        time: Time since the cell was entered [s].
        position: x [rad or m].
        rate: x' [rad/s or m/s].
    """
    k1, k1_dot = ramped_gain(time, row[POSITION_GAIN], row[RAMP_RATE])
    gains = row[LOG_GAIN], k1, k1_dot, row[RATE_GAIN], row[SATURATION]
    return track_axis(position, rate, bounds_of(row, time), gains)


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


@compiled
def track_axes(
    table: FloatArray, time: float, object_state: FloatArray, robot: FloatArray, acceleration: FloatArray
) -> None:
    """Write the desired accelerations of the object's angle and of one robot's joints.

    Args:
        table: The axes (theta, q_k), shape (1 + n, ``LAW_COLUMNS``).
        time: Time since the cell was entered [s].
        object_state: Pose and twist of the object, shape (6,).
        robot: (z_k, z_k'), shape (2 (3 + n),); not read where the robot has no joints.
        acceleration: Receives theta'' and q_k'', shape (1 + n,) [rad/s^2 or m/s^2].
    """
    n = table.shape[0] - 1
    acceleration[0] = track_row(table[0], time, object_state[2], object_state[5])[0]
    for i in range(n):
        acceleration[1 + i] = track_row(table[1 + i], time, robot[3 + i], robot[6 + n + i])[0]


@compiled
def write_bounds(table: FloatArray, time: float, bounds: FloatArray) -> None:
    """Write the lower, then the upper funnel bounds of all axes, shape (2 m,) [rad or m]."""
    m = table.shape[0]
    for i in range(m):
        bounds[i], bounds[m + i] = bounds_of(table[i], time)[:2]
