"""How long a transport takes: by a rule of thumb, and estimated by integrating the loop from cell to cell."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, inf, isfinite, sqrt

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.geometry.polygons import edges_of, nearest_fraction, signed_distance
from coop_drake.jit import compiled
from coop_drake.laws import TransitionGains
from coop_drake.laws.axis_table import (
    FADING_TIME,
    LEAVING_TIME,
    LOG_GAIN,
    SATURATION,
    axis_table,
    bounds_of,
    first_jumps,
    limited_row,
    switch_jump,
    track_row,
)
from coop_drake.laws.governor import (
    ATTRACTION_RATE,
    FIELD_SPEED,
    driving_margin,
    energy_margin,
    governed_acceleration,
    governor_velocity,
    steady_clearance,
    tracking_energy,
)
from coop_drake.laws.ppc import SMOOTHING, SPEED_LIMIT, STIFFNESS, fading, governed_gains, speed_damping
from coop_drake.laws.readiness import (
    axis_arrival,
    axis_ready,
    clearance_margin,
    position_arrival,
)
from coop_drake.tree.arrays import FloatArray

# The time of a transition by rule of thumb, for choices made before gains are known.

SETTLING_TIME = 0.6
"""Time that angles and joints need at any distance, for choices made before gains are known [s]."""

SPEED_PER_CLEARANCE = 3.0
"""Speed over clearance with the paper's gains, for choices made before gains are known [1/s]."""


def travel_time(length: float, clearance: float, speed: float = SPEED_PER_CLEARANCE) -> float:
    """Return the time that the object needs for a path with the same clearance everywhere [s].

    Args:
        length: L, length of the path to the target [m].
        clearance: b, clearance that the path keeps [m].
        speed: Speed over clearance [1/s].
    """
    return length / (speed * clearance) if clearance > 0.0 else inf


def transition_time(length: float, clearance: float, speed: float = SPEED_PER_CLEARANCE) -> float:
    """Return an approximate time of one transition, ``SETTLING_TIME`` more than its travel [s]."""
    return SETTLING_TIME + travel_time(length, clearance, speed)


# Compiled simulation of one transition: a point mass behind its governor, axes in their funnels.
#
# All laws are those of ``coop_drake.laws``. Only the direction of p_G differs from the closed loop: here it
# follows a path, there a harmonic map.

PERIOD = 0.02
"""Time between two checks of readiness [s]: the longest step that the simulator takes by default."""

RADIANS_PER_STEP = 0.6
"""Longest integration step times the angular frequency of the fastest motion [rad]; the fourth-order scheme
is stable up to 2.8, and with 0.6 its error is below that of the path."""

FEWEST_STEPS, MOST_STEPS = 2, 200
"""Integration steps between two checks [-]: at least 2 for accuracy, at most 200 to bound the computing
time."""

LOOKAHEAD = 0.5
"""The governor steers to the point of its path that lies this fraction of its clearance ahead [-]; the
straight line to that point stays in the cell."""

SHORTEST_LOOKAHEAD = 2e-3
"""Shortest distance of that point [m], for a direction that does not depend on rounding where clearance
vanishes."""


@compiled(borrows=True)
def _rates(
    state: FloatArray,
    time: float,
    edges: FloatArray,
    path: FloatArray,
    row: FloatArray,
    table: FloatArray,
    jumps: FloatArray,
    result: FloatArray,
) -> None:
    """Write the rates of (p, p', p_G, axes, axis rates); arguments as in ``cross_cell``."""
    stiffness, damping, gain = governed_gains(row, time)
    clearance = signed_distance(edges, state[4], state[5])
    energy = tracking_energy(state[0] - state[4], state[1] - state[5], state[2], state[3], stiffness)
    margin = energy_margin(energy, clearance, stiffness)
    for i in range(2):
        result[i] = state[2 + i]
        result[2 + i] = governed_acceleration(state[i], state[2 + i], state[4 + i], stiffness, damping)
    power, speed_squared = result[2] * state[2] + result[3] * state[3], state[2] ** 2 + state[3] ** 2
    braking = speed_damping(power, speed_squared, row[SPEED_LIMIT], damping)
    result[2] -= braking * state[2]
    result[3] -= braking * state[3]
    result[4], result[5] = 0.0, 0.0
    steady = steady_clearance(row[SPEED_LIMIT], stiffness, damping, gain)
    driving = driving_margin(margin, clearance, steady, stiffness)
    if driving > 0.0:
        ahead = max(LOOKAHEAD * clearance, SHORTEST_LOOKAHEAD)
        # The field leads along the path, from the point nearest to p_G to one ahead of it; it has the speed
        # ``FIELD_SPEED``, and less near the path's end, as in (13).
        x, y = state[4], state[5]
        nearest, k, fraction = np.inf, 0, 0.0
        for segment in range(path.shape[0] - 1):
            ax, ay, bx, by = path[segment, 0], path[segment, 1], path[segment + 1, 0], path[segment + 1, 1]
            s = nearest_fraction(x, y, ax, ay, bx, by)
            away = hypot(x - ax - s * (bx - ax), y - ay - s * (by - ay))
            if away <= nearest:
                nearest, k, fraction = away, segment, s
        left = ahead + fraction * hypot(path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1])
        aim_x, aim_y = path[-1, 0], path[-1, 1]
        while k < path.shape[0] - 1:
            length = hypot(path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1])
            if left <= length and length > 0.0:
                aim_x = path[k, 0] + left / length * (path[k + 1, 0] - path[k, 0])
                aim_y = path[k, 1] + left / length * (path[k + 1, 1] - path[k, 1])
                break
            left -= length
            k += 1
        vx, vy = 0.0, 0.0
        ux, uy = aim_x - x, aim_y - y
        norm = hypot(ux, uy)
        if norm > 0.0:
            radius = gain * FIELD_SPEED / ATTRACTION_RATE  # as ``slowdown_radius``
            speed = FIELD_SPEED * min(1.0, hypot(path[-1, 0] - x, path[-1, 1] - y) / radius)
            vx, vy = speed * ux / norm, speed * uy / norm
        result[4], result[5] = governor_velocity(vx, vy, driving, stiffness, gain, row[SMOOTHING])
    m = table.shape[0]
    left = fading(time, table[0, FADING_TIME])
    for i in range(m):
        x, rate = state[6 + i], state[6 + m + i]
        wanted = track_row(table[i], time, x, rate)[0] + left * jumps[i]
        result[6 + i], result[6 + m + i] = rate, limited_row(table[i], wanted, rate)


@compiled(borrows=True)
def _may_leave(
    state: FloatArray,
    time: float,
    table: FloatArray,
    target: FloatArray,
    inradius: float,
    next_edges: FloatArray,
    next_stiffness: float,
    next_table: FloatArray,
    last: bool,
) -> bool:
    """Return whether all robots are ready for the next cell, or in the last one are at rest at the goal."""
    m = table.shape[0]
    if last:
        for i in range(m):
            if axis_arrival(table[i], state[6 + i], state[6 + m + i]) < 0.0:
                return False
        distance = hypot(state[0] - target[0], state[1] - target[1])
        return bool(position_arrival(distance, hypot(state[2], state[3]), inradius) >= 0.0)
    if time < table[0, LEAVING_TIME]:
        return False
    for i in range(m):
        if min(axis_ready(table[i], next_table[i], state[6 + i], state[6 + m + i])) < 0.0:
            return False
    clearance = signed_distance(next_edges, state[4], state[5])
    energy = tracking_energy(state[0] - state[4], state[1] - state[5], state[2], state[3], next_stiffness)
    margin = energy_margin(energy, clearance, next_stiffness)
    return bool(clearance_margin(margin, next_stiffness, inradius) >= 0.0)


@compiled
def cross_cell(
    state: FloatArray,
    jumps: FloatArray,
    edges: FloatArray,
    path: FloatArray,
    row: FloatArray,
    table: FloatArray,
    inradius: float,
    next_edges: FloatArray,
    next_row: FloatArray,
    next_table: FloatArray,
    last: bool,
    time_limit: float,
    peaks: FloatArray,
) -> float:
    """Integrate one transition until it may be left, and leave the state as it is then.

    Args:
        state: (p, p', p_G, axes, axis rates), shape (6 + 2 m,) [m, m/s, rad]; changed in place.
        jumps: Jumps of the accelerations of all axes at the switch to this cell, shape (m,); those of the
            switch to the next one are written there.
        edges: Edges of Q, shape (e, 4) [m].
        path: Path to the target, shape (k, 2) [m].
        row: The governor's row, see ``governed_gains``, shape (9,).
        table: The axes in this cell, shape (m, ``LAW_COLUMNS``).
        inradius: R, in the last cell the tolerance of the goal's position [m].
        next_edges: Edges of the next cell.
        next_row: ``row`` of the next cell.
        next_table: ``table`` of the next cell.
        last: Whether the object shall come to rest here; the next cell's data are then not read.
        time_limit: Longest time [s].
        peaks: Largest speed of the object so far, then largest rates and accelerations of all axes, shape
            (1 + 2 m,); what is larger on the way is written there [m/s, rad/s or m/s, rad/s^2 or m/s^2].

    Returns:
        Time that passed [s]; infinite beyond the limit.
    """
    n, m = state.size, table.shape[0]
    k1, k2, k3, k4 = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    time, next_stiffness = 0.0, governed_gains(next_row, 0.0)[0]
    while time <= time_limit:
        if _may_leave(state, time, table, path[-1], inradius, next_edges, next_stiffness, next_table, last):
            for i in range(0 if last else m):
                jumps[i] = switch_jump(table[i], next_table[i], time, state[6 + i], state[6 + m + i])
            return time
        # The steps until the next check are short enough for the fastest motion now: the spring's, p_G's, or
        # the one with which the log term of (18) pulls at an axis where it is now.
        fastest = max(sqrt(row[STIFFNESS]), ATTRACTION_RATE)
        for i in range(m):
            lower, upper, _, _, _, _ = bounds_of(table[i], time)
            width, position = upper - lower, state[6 + i]
            dl = min(max(position - lower, table[i, SATURATION] * width), width)
            du = min(max(upper - position, table[i, SATURATION] * width), width)
            pull = width / (dl * du) * sqrt(table[i, LOG_GAIN] * (1.0 + abs(np.log(dl / du))))
            fastest = max(fastest, pull)
        steps = int(min(max(np.ceil(PERIOD * fastest / RADIANS_PER_STEP), FEWEST_STEPS), MOST_STEPS))
        h = PERIOD / steps
        for k in range(steps):
            t = time + k * h
            _rates(state, t, edges, path, row, table, jumps, k1)
            _rates(state + 0.5 * h * k1, t + 0.5 * h, edges, path, row, table, jumps, k2)
            _rates(state + 0.5 * h * k2, t + 0.5 * h, edges, path, row, table, jumps, k3)
            _rates(state + h * k3, t + h, edges, path, row, table, jumps, k4)
            state += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            peaks[0] = max(peaks[0], hypot(state[2], state[3]))
            for i in range(m):
                peaks[1 + i] = max(peaks[1 + i], abs(state[6 + m + i]))
                peaks[1 + m + i] = max(peaks[1 + m + i], abs(k1[6 + m + i]))
        time += PERIOD
    return np.inf


# Estimates how long a transport takes, before its maps are solved and it is simulated.

LONGEST_ESTIMATED = 120.0
"""A transition that takes longer is not integrated to its end [s]; such a plan is of no use."""


def speed_per_clearance(gains: TransitionGains) -> float:
    """Return the speed of the governed object in a long aisle over its clearance there, v / d [1/s]."""
    return 1.0 / steady_clearance(1.0, gains.stiffness, gains.damping, gains.governor_gain)


def plan_time(plan: Plan) -> float:
    """Return the estimated duration of the whole transport [s]."""
    return sum(transition.estimated_time for transition in plan.transitions)


def timed(plan: Plan) -> Plan:
    """Return the plan with the times of ``estimated``."""
    return estimated(plan)[0]


def estimated(plan: Plan) -> tuple[Plan, FloatArray, FloatArray]:
    """Estimate the time of every transition of a plan, and the largest speeds and accelerations.

    The closed loop is integrated from cell to cell: a point mass behind the governor (14)-(16) with the exact
    distance to the boundary of Q_i, a double integrator in its funnel for every axis, and the conditions of
    readiness. The state is kept from cell to cell, because object and axes do not stop at a switch. p_G
    follows the widest path instead of a harmonic map, which would have to be solved first.

    Args:
        plan: The plan; its present estimates are not read.

    Returns:
        The plan with estimates; ``transition_time`` where a transition is not left within two minutes. And
        the largest speed of the object, then those of the axes (theta, q...), shape (2 + n,) [m/s, rad/s];
        and the largest accelerations of the axes in every cell, shape (cells, 1 + n) [rad/s^2 or m/s^2].
    """
    crossings = [
        (
            np.ascontiguousarray(edges_of(plan.governed(index))),
            plan.governor_row(index),
            axis_table(plan.funnel(index), transition.gains),
        )
        for index, transition in enumerate(plan.transitions)
    ]
    jumps = first_jumps(crossings[0][2], plan.start[2:])
    following = [*crossings[1:], crossings[-1]]
    state = _at_rest(plan.start[:2], plan.start[2:])
    m = len(plan.start) - 2
    transitions, speeds, accelerations = [], np.zeros(1 + m), np.zeros((len(crossings), m))
    for index, (transition, (edges, gains, table)) in enumerate(
        zip(plan.transitions, crossings, strict=True)
    ):
        last, peaks = index + 1 == len(crossings), np.zeros(1 + 2 * m)
        next_edges, next_gains, next_table = following[index]
        seconds = cross_cell(
            state, jumps, edges, transition.path, gains, table, transition.inradius,
            next_edges, next_gains, next_table, last, LONGEST_ESTIMATED, peaks,
        )  # fmt: skip
        speeds, accelerations[index] = np.maximum(speeds, peaks[: 1 + m]), peaks[1 + m :]
        if not isfinite(seconds):
            speed = speed_per_clearance(transition.gains)
            seconds = LONGEST_ESTIMATED + transition_time(transition.length, transition.neck, speed)
            state = _at_rest(transition.target, 0.5 * (transition.goal_lower + transition.goal_upper))
            jumps[:] = 0.0
        transitions.append(replace(transition, estimated_time=seconds))
    return replace(plan, transitions=tuple(transitions)), speeds, accelerations


def _at_rest(position: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the state (p, p', p_G, axes, axis rates) at rest."""
    return np.concatenate([position, np.zeros(2), position, axes, np.zeros(len(axes))])
