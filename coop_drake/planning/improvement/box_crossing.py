"""Compiled simulation of one box of a box sequence, quick enough to compare thousands of boxes.

The object moves in one dimension, along its path, behind its governor (14)-(16); the clearance is
interpolated between waypoints. Every angle and joint moves in its funnel, (18)-(20). All laws are those of
``coop_drake.laws``.
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
    limited_row,
    track_row,
    write_row,
)
from coop_drake.laws.gain_schedule import Schedule, scheduled_axis, scheduled_governor
from coop_drake.laws.governor import (
    FIELD_SPEED,
    driving_margin,
    energy_margin,
    governed_acceleration,
    governor_velocity,
    slowdown_radius,
    steady_clearance,
    tracking_energy,
)
from coop_drake.laws.readiness import axis_arrival, clearance_margin, interval_margin, position_arrival
from coop_drake.laws.speed_limit import damped
from coop_drake.planning.execution.transport_kernels import PERIOD, axis_frequency
from coop_drake.tree.pose import FloatArray

__all__ = ["cross_box", "smallest"]

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

LEAST_CLEARANCE = 1e-4
"""A box narrower than this counts as this wide where gains are scheduled [m], so that K stays finite."""


@compiled
def _clearance_at(arc_lengths: FloatArray, clearances: FloatArray, s: float) -> float:
    """Return the clearance between two waypoints [m]."""
    for k in range(len(arc_lengths) - 1):
        if s <= arc_lengths[k + 1]:
            fraction = max(s - arc_lengths[k], 0.0) / max(arc_lengths[k + 1] - arc_lengths[k], 1e-12)
            return float(clearances[k] + fraction * (clearances[k + 1] - clearances[k]))
    return float(clearances[-1])


@compiled
def _advance_position(
    state: FloatArray,
    h: float,
    arc_lengths: FloatArray,
    clearances: FloatArray,
    gains: tuple[float, float, float],
    smoothing: float,
    limit: float,
) -> None:
    """Take one step of (s, s', s_G) at constant speed of p_G, which changes slowly against the step."""
    s, v, g = state[0], state[1], state[2]
    stiffness, damping, gain = gains
    d = _clearance_at(arc_lengths, clearances, g)
    margin = energy_margin(tracking_energy(s - g, 0.0, v, 0.0, stiffness), d, stiffness)
    field = FIELD_SPEED * min(1.0, max(arc_lengths[-1] - g, 0.0) / slowdown_radius(FIELD_SPEED, gain))
    driving = driving_margin(margin, d, steady_clearance(limit, stiffness, damping, gain), stiffness)
    speed, _ = governor_velocity(field, 0.0, driving, stiffness, gain, smoothing)
    middle = g + 0.5 * h * speed
    a1 = damped(governed_acceleration(s, v, g, stiffness, damping), v, limit, damping)
    v2 = v + 0.5 * h * a1
    a2 = damped(governed_acceleration(s + 0.5 * h * v, v2, middle, stiffness, damping), v2, limit, damping)
    v3 = v + 0.5 * h * a2
    a3 = damped(governed_acceleration(s + 0.5 * h * v2, v3, middle, stiffness, damping), v3, limit, damping)
    v4 = v + h * a3
    a4 = damped(governed_acceleration(s + h * v3, v4, g + h * speed, stiffness, damping), v4, limit, damping)
    state[0] = s + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
    state[1] = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    state[2] = g + h * speed


@compiled
def _advance_axis(state: FloatArray, at: int, m: int, time: float, row: FloatArray) -> None:
    """Advance one axis by one period, in as many steps as its stiffness needs now."""
    fastest = axis_frequency(row, time, state[at], max(row[SATURATION], LEAST_SATURATION))
    steps = int(min(max(np.ceil(PERIOD * fastest / RADIANS_PER_STEP), 1.0), MOST_STEPS))
    h = PERIOD / steps
    for k in range(steps):
        t = time + k * h
        x, v1 = state[at], state[at + m]
        a1 = limited_row(row, track_row(row, t, x, v1)[0], v1)
        v2 = v1 + 0.5 * h * a1
        a2 = limited_row(row, track_row(row, t + 0.5 * h, x + 0.5 * h * v1, v2)[0], v2)
        v3 = v1 + 0.5 * h * a2
        a3 = limited_row(row, track_row(row, t + 0.5 * h, x + 0.5 * h * v2, v3)[0], v3)
        v4 = v1 + h * a3
        a4 = limited_row(row, track_row(row, t + h, x + h * v3, v4)[0], v4)
        state[at] = x + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
        state[at + m] = v1 + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@compiled
def _arrived(state: FloatArray, target: float, table: FloatArray, tolerance: float) -> bool:
    """Return whether the goal is reached and the motion has ended."""
    m = table.shape[0]
    for a in range(m):
        if axis_arrival(table[a], state[3 + a], state[3 + m + a]) < 0.0:
            return False
    return bool(position_arrival(abs(state[0] - target), abs(state[1]), tolerance) >= 0.0)


@compiled
def _may_leave(
    state: FloatArray,
    target: float,
    clearance: float,
    stiffness: float,
    table: FloatArray,
    schedule: Schedule,
) -> bool:
    """Return whether the next box, of which only the clearance at the target is known, may be entered."""
    m = table.shape[0]
    for a in range(m):
        row = table[a]
        if interval_margin(state[3 + a], row[GOAL_LOWER], row[GOAL_UPPER], LEAVING_EROSION) < 0.0:
            return False
        allowance = schedule.energy_allowance * row[LOG_GAIN] + schedule.entry_energy
        if abs(state[3 + m + a]) > RATE_FRACTION * sqrt(2.0 * allowance):
            return False
    s, v, g = state[0], state[1], state[2]
    # The next cell's clearance at p_G is at least that at the target less the distance to the target.
    left = max(clearance - abs(target - g), 0.0)
    margin = energy_margin(tracking_energy(s - g, 0.0, v, 0.0, stiffness), left, stiffness)
    return bool(clearance_margin(margin, stiffness, clearance) >= 0.0)


@compiled
def smallest(values: FloatArray) -> float:
    """The smallest of some values, shape (k,); numpy's ``min`` takes longer to compile."""
    least = np.inf
    for k in range(len(values)):
        least = min(least, values[k])
    return least


@compiled
def cross_box(
    state: FloatArray,
    arc_lengths: FloatArray,
    clearances: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    goal_intervals: FloatArray,
    axis_rest: FloatArray,
    schedule: Schedule,
    limits: FloatArray,
    tolerance: float,
    time_limit: float,
) -> float:
    """Simulate the motion through one box.

    Args:
        state: (s, s', s_G, axes, axis rates), shape (3 + 2 m,); changed in place [m, m/s, rad].
        arc_lengths: Lengths of the path up to its waypoints, the last one the target, shape (k,) [m].
        clearances: Clearance at the waypoints, shape (k,) [m].
        lower: Lower ends of the slice, shape (m,).
        upper: Upper ends of the slice, shape (m,).
        goal_intervals: Lower and upper ends of the goal intervals, shape (2, m).
        axis_rest: Where the axes were aimed at before, shape (m,).
        schedule: The rule that gives the gains.
        limits: Largest speed of the object, then largest rates of all axes, infinity for none, shape
            (1 + m,) [m/s, rad/s or m/s].
        tolerance: Of the goal's position in the last box, otherwise 0 [m].
        time_limit: Longest time [s].

    Returns:
        Time that passed [s]; infinite beyond the time limit.
    """
    m = len(lower)
    gains = scheduled_governor(schedule, max(smallest(clearances), LEAST_CLEARANCE))
    table = np.empty((m, LAW_COLUMNS))
    narrowest = smallest(goal_intervals[1, 1:] - goal_intervals[0, 1:])
    for a in range(m):
        ends = lower[a], upper[a], goal_intervals[0, a], goal_intervals[1, a]
        scheduled = scheduled_axis(
            schedule, a > 0, ends[0], ends[1], ends[2], ends[3], axis_rest[a], narrowest, limits[1 + a],
            np.inf,
        )  # fmt: skip
        gains_of_axes = (
            schedule.position_gain, schedule.rate_gain, schedule.ramp_rate, schedule.saturation,
            schedule.hand_over_time,
        )  # fmt: skip
        most = limits[1 + a], schedule.limit_gain, np.inf  # boxes are chosen without limits of acceleration
        write_row(table[a], ends, scheduled, gains_of_axes, schedule.quintic, most)
    time = 0.0
    while time <= time_limit:
        if tolerance > 0.0:
            if _arrived(state, arc_lengths[-1], table, tolerance):
                return time
        elif time >= schedule.hand_over_time and _may_leave(
            state, arc_lengths[-1], clearances[-1], gains[0], table, schedule
        ):
            return time
        for _ in range(2):
            _advance_position(
                state, 0.5 * PERIOD, arc_lengths, clearances, gains, schedule.smoothing, limits[0]
            )
        for a in range(m):
            _advance_axis(state, 3 + a, m, time, table[a])
        time += PERIOD
    return np.inf
