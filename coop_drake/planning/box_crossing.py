"""Compiled simulation of one box of a box sequence, quick enough to compare thousands of boxes."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
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
from coop_drake.laws.ppc import track_axis
from coop_drake.laws.readiness import axis_arrival, clearance_margin, interval_margin, position_arrival
from coop_drake.laws.speed_limit import damped
from coop_drake.planning.duration import PERIOD, axis_frequency
from coop_drake.tree.pose import FloatArray, IntArray

# Compiled motion of the object through a box, along waypoints: the same whatever the axes do meanwhile.

LEAST_CLEARANCE = 1e-4
"""A box narrower than this counts as this wide where gains are scheduled [m], so that K stays finite."""


class ObjectMotion(NamedTuple):
    """Motion in one dimension behind the governor (14)-(16), simulated as far as it was asked for.

    Attributes:
        arc_lengths: Lengths of the path up to the box's waypoints, the last one the target, shape (k,) [m].
        clearances: Clearance at the waypoints, shape (k,) [m].
        gains: K [1/s^2], D [1/s] and k_G [1/s] in the box.
        smoothing: Of the governor's gain.
        limit: Largest speed of the object [m/s].
        tolerance: Of the goal's position in the last box, otherwise 0 [m].
        hand_over_time: Time before which no box is left, but the last one [s].
        states: (s, s', s_G) at checks of readiness, ``PERIOD`` apart, shape (c, 3) [m, m/s, m].
        known: Number of rows that are known, shape (1,).
    """

    arc_lengths: FloatArray
    clearances: FloatArray
    gains: tuple[float, float, float]
    smoothing: float
    limit: float
    tolerance: float
    hand_over_time: float
    states: FloatArray
    known: IntArray


@compiled(borrows=True)
def smallest(values: FloatArray) -> float:
    """The smallest of some values, shape (k,); numpy's ``min`` takes longer to compile."""
    least = np.inf
    for k in range(len(values)):
        least = min(least, values[k])
    return least


@compiled
def object_motion(
    start: FloatArray,
    arc_lengths: FloatArray,
    clearances: FloatArray,
    schedule: Schedule,
    limit: float,
    tolerance: float,
    states: FloatArray,
) -> ObjectMotion:
    """Begin the motion through a box.

    Args:
        start: (s, s', s_G) and anything, shape (3 or more,) [m, m/s, m].
        arc_lengths: With the next as in ``ObjectMotion``.
        clearances: Clearance at the waypoints, shape (k,) [m].
        schedule: The rule that gives the gains.
        limit: With the next as in ``ObjectMotion``.
        tolerance: Of the goal's position in the last box, otherwise 0 [m].
        states: Memory for the motion, a row for every check of readiness, shape (c, 3).
    """
    for k in range(3):
        states[0, k] = start[k]
    gains = scheduled_governor(schedule, max(smallest(clearances), LEAST_CLEARANCE))
    return ObjectMotion(
        arc_lengths, clearances, gains, schedule.smoothing, limit, tolerance, schedule.hand_over_time,
        states, np.ones(1, np.int64),
    )  # fmt: skip


@compiled(borrows=True)
def object_may_leave(motion: ObjectMotion, check: int, time: float) -> bool:
    """Whether the object lets the next box be entered at a check, or has arrived in the last box.

    Of the next box only the clearance at the target is known.

    Args:
        motion: The motion; it is simulated up to this check.
        check: Number of the check, below the number of rows of ``states``.
        time: When it is [s].
    """
    for row in range(motion.known[0], check + 1):
        for k in range(3):
            motion.states[row, k] = motion.states[row - 1, k]
        for _ in range(2):
            _advance(motion, motion.states[row], 0.5 * PERIOD)
        motion.known[0] = row + 1
    s, v, g = motion.states[check, 0], motion.states[check, 1], motion.states[check, 2]
    target, clearance, stiffness = motion.arc_lengths[-1], motion.clearances[-1], motion.gains[0]
    if motion.tolerance > 0.0:
        return bool(position_arrival(abs(s - target), abs(v), motion.tolerance) >= 0.0)
    if time < motion.hand_over_time:
        return False
    # The next cell's clearance at p_G is at least that at the target less the distance to the target.
    left = max(clearance - abs(target - g), 0.0)
    margin = energy_margin(tracking_energy(s - g, 0.0, v, 0.0, stiffness), left, stiffness)
    return bool(clearance_margin(margin, stiffness, clearance) >= 0.0)


@compiled(borrows=True)
def soonest_exit(motion: ObjectMotion, time_limit: float) -> float:
    """Return when the object may first leave the box, infinity beyond the limit: axes only delay this [s]."""
    time = 0.0
    for check in range(len(motion.states)):
        if time > time_limit:
            break
        if object_may_leave(motion, check, time):
            return time
        time += PERIOD
    return np.inf


@compiled(borrows=True)
def _clearance_at(arc_lengths: FloatArray, clearances: FloatArray, s: float) -> float:
    """Return the clearance between two waypoints [m]."""
    for k in range(len(arc_lengths) - 1):
        if s <= arc_lengths[k + 1]:
            fraction = max(s - arc_lengths[k], 0.0) / max(arc_lengths[k + 1] - arc_lengths[k], 1e-12)
            return float(clearances[k] + fraction * (clearances[k + 1] - clearances[k]))
    return float(clearances[-1])


@compiled(borrows=True)
def _advance(motion: ObjectMotion, state: FloatArray, h: float) -> None:
    """Take one step of (s, s', s_G) at constant speed of p_G, which changes slowly against the step."""
    s, v, g = state[0], state[1], state[2]
    stiffness, damping, gain = motion.gains
    limit = motion.limit
    d = _clearance_at(motion.arc_lengths, motion.clearances, g)
    margin = energy_margin(tracking_energy(s - g, 0.0, v, 0.0, stiffness), d, stiffness)
    left = max(motion.arc_lengths[-1] - g, 0.0)
    field = FIELD_SPEED * min(1.0, left / slowdown_radius(FIELD_SPEED, gain))
    driving = driving_margin(margin, d, steady_clearance(limit, stiffness, damping, gain), stiffness)
    speed, _ = governor_velocity(field, 0.0, driving, stiffness, gain, motion.smoothing)
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


# The object moves along its path, see ``object_motion``; every angle and joint moves in its funnel,
# (18)-(20). All laws are those of ``coop_drake.laws``.

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


@compiled(borrows=True)
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


@compiled(borrows=True)
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
