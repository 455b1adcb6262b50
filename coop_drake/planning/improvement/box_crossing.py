"""Compiled simulation of one box of a box sequence, quick enough to compare thousands of boxes.

The object moves along its path, see ``object_motion``; every angle and joint moves in its funnel, (18)-(20).
All laws are those of ``coop_drake.laws``.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import (
    GOAL_LOWER,
    GOAL_UPPER,
    LAW_COLUMNS,
    LOG_GAIN,
    SATURATION,
    law_at,
    limited_row,
    write_row,
)
from coop_drake.laws.gain_schedule import Schedule, scheduled_axis
from coop_drake.laws.ppc import track_axis
from coop_drake.laws.readiness import axis_arrival, interval_margin
from coop_drake.planning.execution.transport_kernels import PERIOD, axis_frequency
from coop_drake.planning.improvement.object_motion import ObjectMotion, object_may_leave, smallest
from coop_drake.tree.pose import FloatArray

__all__ = ["cross_box"]

MOST_STEPS = 64
"""Largest number of integration steps of an axis between two checks of readiness [-], to bound the time."""

RADIANS_PER_STEP = 1.6
"""Longest step of an axis times the angular frequency of its motion [rad]: the fourth-order scheme is
stable up to 2.8, and a comparison of boxes needs less accuracy than the estimate of a plan."""

LEAST_SATURATION = 1e-3
"""Smallest distance to a funnel bound, over the funnel's width, for which the step of an axis is shortened
[-]."""

LEAVING_EROSION = 0.25
"""Fraction of a goal interval, at each end, in which an axis does not leave a box [-]. It is larger than
that of the closed loop: near an end the next funnel, which is not known yet, could not be entered."""

RATE_FRACTION = 0.9
"""Fraction of the energy allowance of the next funnel that the rate of an axis may take [-]."""


@compiled
def _advance_axis(state: FloatArray, at: int, m: int, time: float, row: FloatArray) -> None:
    """Advance one axis by one period, in as many steps as its stiffness needs now."""
    fastest = axis_frequency(row, time, state[at], max(row[SATURATION], LEAST_SATURATION))
    steps = int(min(max(np.ceil(PERIOD * fastest / RADIANS_PER_STEP), 1.0), MOST_STEPS))
    h = PERIOD / steps
    now, gains_now = law_at(row, time, 1.0, 0.0)
    for k in range(steps):
        t = time + k * h
        middle, gains_middle = law_at(row, t + 0.5 * h, 1.0, 0.0)
        end, gains_end = law_at(row, t + h, 1.0, 0.0)
        x, v1 = state[at], state[at + m]
        a1 = limited_row(row, track_axis(x, v1, now, gains_now)[0], v1)
        v2 = v1 + 0.5 * h * a1
        a2 = limited_row(row, track_axis(x + 0.5 * h * v1, v2, middle, gains_middle)[0], v2)
        v3 = v1 + 0.5 * h * a2
        a3 = limited_row(row, track_axis(x + 0.5 * h * v2, v3, middle, gains_middle)[0], v3)
        v4 = v1 + h * a3
        a4 = limited_row(row, track_axis(x + h * v3, v4, end, gains_end)[0], v4)
        state[at] = x + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
        state[at + m] = v1 + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        now, gains_now = end, gains_end


@compiled
def _axes_may_leave(state: FloatArray, table: FloatArray, schedule: Schedule, last: bool) -> bool:
    """Return whether the axes let the next box be entered, or rest at the goal in the last box."""
    m = table.shape[0]
    for a in range(m):
        row = table[a]
        if last:
            if axis_arrival(row, state[3 + a], state[3 + m + a]) < 0.0:
                return False
            continue
        if interval_margin(state[3 + a], row[GOAL_LOWER], row[GOAL_UPPER], LEAVING_EROSION) < 0.0:
            return False
        allowance = schedule.energy_allowance * row[LOG_GAIN] + schedule.entry_energy
        if abs(state[3 + m + a]) > RATE_FRACTION * sqrt(2.0 * allowance):
            return False
    return True


@compiled
def cross_box(
    state: FloatArray,
    motion: ObjectMotion,
    lower: FloatArray,
    upper: FloatArray,
    goal_intervals: FloatArray,
    axis_rest: FloatArray,
    schedule: Schedule,
    limits: FloatArray,
    time_limit: float,
) -> float:
    """Simulate the motion through one box.

    Args:
        state: (s, s', s_G, axes, axis rates), shape (3 + 2 m,); changed in place [m, m/s, rad].
        motion: The motion of the object.
        lower: Lower ends of the slice, shape (m,).
        upper: Upper ends of the slice, shape (m,).
        goal_intervals: Lower and upper ends of the goal intervals, shape (2, m).
        axis_rest: Where the axes were aimed at before, shape (m,).
        schedule: The rule that gives the gains.
        limits: Largest rates of all axes, infinity for none, shape (m,) [rad/s or m/s].
        time_limit: Longest time [s].

    Returns:
        Time that passed [s]; infinite beyond the time limit.
    """
    m = len(lower)
    table = np.empty((m, LAW_COLUMNS))
    narrowest = smallest(goal_intervals[1, 1:] - goal_intervals[0, 1:])
    for a in range(m):
        ends = lower[a], upper[a], goal_intervals[0, a], goal_intervals[1, a]
        scheduled = scheduled_axis(
            schedule, a > 0, ends[0], ends[1], ends[2], ends[3], axis_rest[a], narrowest, limits[a],
            np.inf,
        )  # fmt: skip
        gains_of_axes = (
            schedule.position_gain, schedule.rate_gain, schedule.ramp_rate, schedule.saturation,
            schedule.hand_over_time,
        )  # fmt: skip
        most = limits[a], schedule.limit_gain, np.inf  # boxes are chosen without limits of acceleration
        write_row(table[a], ends, scheduled, gains_of_axes, schedule.quintic, most)
    time = 0.0
    for check in range(len(motion.states)):
        if time > time_limit:
            break
        if object_may_leave(motion, check, time) and _axes_may_leave(
            state, table, schedule, motion.tolerance > 0.0
        ):
            for k in range(3):
                state[k] = motion.states[check, k]
            return time
        for a in range(m):
            _advance_axis(state, 3 + a, m, time, table[a])
        time += PERIOD
    return np.inf
