"""Compiled simulation of a way through one box in one dimension, quick enough to compare thousands of boxes.

The object moves along a line behind its governor (14)-(16), the clearance interpolated between waypoints,
and every axis moves in its funnel, (18)-(20). Gains follow the rules of ``transition_gains``.
"""

from __future__ import annotations

from math import log, sqrt
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.kernels import SATURATION, decay, track_axis
from coop_drake.laws.ready import CLEARANCE_FRACTION, EROSION
from coop_drake.planning.execution.transport_kernels import PERIOD, RATE_TOLERANCE, SPEED_TOLERANCE
from coop_drake.tree.pose import FloatArray

__all__ = ["Schedule", "cross_box", "scheduled_laws"]

MOST_STEPS = 64
"""Steps of an axis between two judgements, at most."""

STEP_PER_PERIOD = 1.6
"""Longest step of an axis, over the shortest period of its motion through 2 pi [-]."""

LEAVING_SHARE = 0.5
"""Share of a goal interval within which an axis leaves a box: at its edge the next funnel, which is not
known yet, would not be entered [-]."""

GATE_SHARE = 0.9
"""Share of the energy allowed in the next funnel that the rate of an axis may take [-]."""


class Schedule(NamedTuple):
    """Numbers of a gain set, fixed gains with equal bounds.

    Attributes:
        wall_stiffness: K times the neck [m/s^2].
        stiffness: Smallest and largest K [1/s^2], shape (2,).
        damping: zeta over sqrt(K) [-].
        governor: K_G over sqrt(K) [s].
        smoothing: c [m].
        attraction: Rate at which p_G is drawn into its target [1/s].
        smooth: Whether funnels are smooth.
        acceleration: Wall acceleration aimed at [rad/s^2 or m/s^2].
        decay: Smallest and largest lambda of the angle and of joints [1/s], shape (2, 2).
        log_gain: Largest kappa.
        log_acceleration: Largest kappa |a s| at rest.
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].
        allowance: Energy that a funnel is entered with, over kappa [-].
    """

    wall_stiffness: float
    stiffness: FloatArray
    damping: float
    governor: float
    smoothing: float
    attraction: float
    smooth: bool
    acceleration: float
    decay: FloatArray
    log_gain: float
    log_acceleration: float
    position_gain: float
    rate_gain: float
    allowance: float


@compiled
def scheduled_laws(
    schedule: Schedule,
    neck: float,
    lower: FloatArray,
    upper: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    resting: FloatArray,
) -> tuple[float, FloatArray, FloatArray]:
    """K, and lambda and kappa of every axis: the rules of ``transition_gains``."""
    stiffness = min(max(schedule.wall_stiffness / neck, schedule.stiffness[0]), schedule.stiffness[1])
    m = len(lower)
    rates, log_gains = np.empty(m), np.empty(m)
    for a in range(m):
        shrink = max(goal_lower[a] - lower[a], upper[a] - goal_upper[a], 1e-9)
        slowest, fastest = schedule.decay[min(a, 1), 0], schedule.decay[min(a, 1), 1]
        rates[a] = min(max(sqrt(schedule.acceleration / shrink), slowest), fastest)
        width = upper[a] - lower[a]
        dl = min(max(resting[a] - lower[a], SATURATION * width), (1.0 - SATURATION) * width)
        pull = abs(log(dl / (width - dl))) * width / (dl * (width - dl))
        log_gains[a] = min(schedule.log_gain, schedule.log_acceleration / max(pull, 1e-9))
    return stiffness, rates, log_gains


@compiled
def _clearance_at(places: FloatArray, room: FloatArray, s: float) -> float:
    """Clearance between two waypoints."""
    for k in range(len(places) - 1):
        if s <= places[k + 1]:
            share = max(s - places[k], 0.0) / max(places[k + 1] - places[k], 1e-12)
            return float(room[k] + share * (room[k + 1] - room[k]))
    return float(room[-1])


@compiled
def _advance_position(
    state: FloatArray, h: float, places: FloatArray, room: FloatArray, stiffness: float, schedule: Schedule
) -> None:
    """One step of (s, s', s_G) with the governor's speed held: it changes slowly against the step."""
    s, v, g = state[0], state[1], state[2]
    damping, gain = schedule.damping * sqrt(stiffness), schedule.governor * sqrt(stiffness)
    energy = 0.5 * (v * v + stiffness * (s - g) ** 2)
    d = _clearance_at(places, room, g)
    margin = 0.5 * stiffness * d * d - energy
    speed = 0.0
    if margin > 0.0:
        root = sqrt(margin / stiffness + schedule.smoothing**2) - schedule.smoothing
        speed = min(gain * min(1.0, root), schedule.attraction * max(places[-1] - g, 0.0))
    middle = g + 0.5 * h * speed
    a1 = -stiffness * (s - g) - damping * v
    v2 = v + 0.5 * h * a1
    a2 = -stiffness * (s + 0.5 * h * v - middle) - damping * v2
    v3 = v + 0.5 * h * a2
    a3 = -stiffness * (s + 0.5 * h * v2 - middle) - damping * v3
    v4 = v + h * a3
    a4 = -stiffness * (s + h * v3 - g - h * speed) - damping * v4
    state[0] = s + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
    state[1] = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
    state[2] = g + h * speed


@compiled
def _pull(x: float, rate: float, time: float, axis: FloatArray, log_gain: float, schedule: Schedule) -> float:
    """Acceleration of one axis; ``axis`` is (slice lower, upper, goal lower, upper, lambda)."""
    value, first, second = decay(time, axis[4], schedule.smooth)
    below, above = axis[0] - axis[2], axis[1] - axis[3]
    acceleration, _ = track_axis(
        x,
        rate,
        axis[2] + below * value,
        axis[3] + above * value,
        below * first,
        above * first,
        below * second,
        above * second,
        log_gain,
        schedule.position_gain,
        schedule.rate_gain,
    )
    return acceleration


@compiled
def _advance_axis(
    state: FloatArray, at: int, m: int, time: float, axis: FloatArray, log_gain: float, schedule: Schedule
) -> None:
    """One period of one axis, in as many steps as its stiffness needs now."""
    value, _, _ = decay(time, axis[4], schedule.smooth)
    lower = axis[2] + (axis[0] - axis[2]) * value
    upper = axis[3] + (axis[1] - axis[3]) * value
    width = upper - lower
    dl = min(max(state[at] - lower, 1e-3 * width), width)
    du = min(max(upper - state[at], 1e-3 * width), width)
    fastest = width / (dl * du) * sqrt(log_gain * (1.0 + abs(log(dl / du))))
    steps = int(min(max(np.ceil(PERIOD * fastest / STEP_PER_PERIOD), 1.0), MOST_STEPS))
    h = PERIOD / steps
    for k in range(steps):
        t = time + k * h
        x, v1 = state[at], state[at + m]
        a1 = _pull(x, v1, t, axis, log_gain, schedule)
        v2 = v1 + 0.5 * h * a1
        a2 = _pull(x + 0.5 * h * v1, v2, t + 0.5 * h, axis, log_gain, schedule)
        v3 = v1 + 0.5 * h * a2
        a3 = _pull(x + 0.5 * h * v2, v3, t + 0.5 * h, axis, log_gain, schedule)
        v4 = v1 + h * a3
        a4 = _pull(x + h * v3, v4, t + h, axis, log_gain, schedule)
        state[at] = x + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
        state[at + m] = v1 + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@compiled
def _may_leave(
    state: FloatArray,
    target: float,
    room: float,
    stiffness: float,
    goals: FloatArray,
    gates: FloatArray,
    tolerance: float,
) -> bool:
    """The conditions of readiness, those of arrival where a tolerance is given."""
    s, v, g = state[0], state[1], state[2]
    m = goals.shape[1]
    for a in range(m):
        half = 0.5 * (goals[1, a] - goals[0, a])
        share = 1.0 - 2.0 * EROSION if tolerance > 0.0 else LEAVING_SHARE
        if abs(state[3 + a] - goals[0, a] - half) > share * half:
            return False
        if abs(state[3 + m + a]) > (RATE_TOLERANCE if tolerance > 0.0 else gates[a]):
            return False
    if tolerance > 0.0:
        return bool(abs(s - target) <= (1.0 - EROSION) * tolerance and abs(v) <= SPEED_TOLERANCE)
    # The next cell's clearance at p_G is at least what it is at the target less the way to go.
    left = max(room - abs(target - g), 0.0)
    lag = v * v / stiffness + (s - g) ** 2
    return bool(left * left - lag >= (CLEARANCE_FRACTION * room) ** 2)


@compiled
def cross_box(
    state: FloatArray,
    places: FloatArray,
    room: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    goals: FloatArray,
    resting: FloatArray,
    schedule: Schedule,
    tolerance: float,
    limit: float,
) -> float:
    """Simulate the way through one box.

    Args:
        state: (s, s', s_G, axes, axis rates), shape (3 + 2 m,); changed in place [m, m/s, rad].
        places: Where the waypoints lie along the whole way, the last one the target, shape (k,) [m].
        room: Clearance at them, shape (k,) [m].
        lower: Lower ends of the slice, shape (m,).
        upper: Upper ends, shape (m,).
        goals: Lower and upper ends of the goal intervals, shape (2, m).
        resting: Where the axes were aimed at before, shape (m,).
        schedule: Gains.
        tolerance: Of the goal's position in the last box, otherwise 0 [m].
        limit: Longest time [s].

    Returns:
        Time that passed [s]; infinite beyond the limit.
    """
    m = len(lower)
    neck = max(room.min(), 1e-4)
    stiffness, rates, log_gains = scheduled_laws(schedule, neck, lower, upper, goals[0], goals[1], resting)
    axes = np.empty((m, 5))
    for a in range(m):
        axes[a, 0], axes[a, 1], axes[a, 2], axes[a, 3] = lower[a], upper[a], goals[0, a], goals[1, a]
        axes[a, 4] = rates[a]
    gates = GATE_SHARE * np.sqrt(2.0 * schedule.allowance * log_gains)
    time = 0.0
    while time <= limit:
        if _may_leave(state, places[-1], room[-1], stiffness, goals, gates, tolerance):
            return time
        for _ in range(2):
            _advance_position(state, 0.5 * PERIOD, places, room, stiffness, schedule)
        for a in range(m):
            _advance_axis(state, 3 + a, m, time, axes[a], log_gains[a], schedule)
        time += PERIOD
    return np.inf
