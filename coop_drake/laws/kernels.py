"""Compiled inner loops of the laws; what they compute is explained in funnels.py, ppc.py and load_sharing.py.

Laws that run in the loop read what they need of one cell from one table, one row for each axis: every array
that is handed over takes longer than the law itself.
"""

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.gains import FloatArray

Walls = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]

# Positions closer to a wall than this fraction of the funnel's width, or beyond it, count as this far inside:
# trial steps of an integrator may stand there, and must get an answer that points back inside and does not
# grow with the distance, or the next trial overflows before the integrator can shorten its step.
SATURATION = 1e-7
# Columns of the table of a cell's axes: slice, goal interval, lambda, whether the funnel is smooth, kappa,
# k1, k2, and the largest V with which the cell is entered.
LAW_COLUMNS = 10


@compiled
def decay(time: float, rate: float, smooth: bool) -> tuple[float, float, float]:
    """Return the factor by which a wall's offset from its goal decays, and its first two derivatives."""
    exponential = np.exp(-rate * time)
    if not smooth:
        return exponential, -rate * exponential, rate * rate * exponential
    return (
        (1.0 + rate * time) * exponential,
        -rate * rate * time * exponential,
        rate * rate * (rate * time - 1.0) * exponential,
    )


@compiled
def track_axis(
    position: float,
    rate: float,
    lower: float,
    upper: float,
    lower_rate: float,
    upper_rate: float,
    lower_acceleration: float,
    upper_acceleration: float,
    log_gain: float,
    position_gain: float,
    rate_gain: float,
) -> tuple[float, float]:
    """Return the acceleration and the energy of the back-stepping law on one axis; see ``ppc``."""
    w, w_dot = upper - lower, upper_rate - lower_rate
    near, far = SATURATION * w, (1.0 - SATURATION) * w
    dl = min(max(position - lower, near), far)
    du = min(max(upper - position, near), far)
    dl_dot, du_dot = rate - lower_rate, upper_rate - rate
    s, s_dot = np.log(dl / du), dl_dot / dl - du_dot / du
    a = w / (dl * du)
    v = (lower_rate * du + upper_rate * dl - position_gain * s * dl * du) / w
    v_dot = (
        lower_acceleration * du
        + lower_rate * du_dot
        + upper_acceleration * dl
        + upper_rate * dl_dot
        - position_gain * (s_dot * dl * du + s * (dl_dot * du + dl * du_dot))
        - v * w_dot
    ) / w
    acceleration = -rate_gain * (rate - v) + v_dot - log_gain * a * s
    return acceleration, 0.5 * log_gain * s * s + 0.5 * (rate - v) * (rate - v)


@compiled
def funnel_walls(
    time: float,
    slice_lower: FloatArray,
    slice_upper: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    decay_rate: FloatArray,
    smooth: bool,
) -> Walls:
    """Return the walls (lower, upper), their rates and their accelerations, each of shape (m,)."""
    m = slice_lower.size
    lower, upper, lower_rate, upper_rate = np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    lower_acceleration, upper_acceleration = np.empty(m), np.empty(m)
    for i in range(m):
        value, first, second = decay(time, decay_rate[i], smooth)
        below, above = slice_lower[i] - goal_lower[i], slice_upper[i] - goal_upper[i]
        lower[i], upper[i] = goal_lower[i] + below * value, goal_upper[i] + above * value
        lower_rate[i], upper_rate[i] = below * first, above * first
        lower_acceleration[i], upper_acceleration[i] = below * second, above * second
    return lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration


@compiled
def track_walls(
    position: FloatArray,
    rate: FloatArray,
    walls: Walls,
    log_gain: FloatArray,
    position_gain: float,
    rate_gain: float,
) -> tuple[FloatArray, FloatArray]:
    """Return acceleration and energy of every axis, each of shape (m,)."""
    lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration = walls
    acceleration, energy = np.empty(position.size), np.empty(position.size)
    for i in range(position.size):
        acceleration[i], energy[i] = track_axis(
            position[i],
            rate[i],
            lower[i],
            upper[i],
            lower_rate[i],
            upper_rate[i],
            lower_acceleration[i],
            upper_acceleration[i],
            log_gain[i],
            position_gain,
            rate_gain,
        )
    return acceleration, energy


@compiled
def track_funnel(
    time: float,
    slice_lower: FloatArray,
    slice_upper: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    decay_rate: FloatArray,
    smooth: bool,
    position: FloatArray,
    rate: FloatArray,
    log_gain: FloatArray,
    position_gain: float,
    rate_gain: float,
) -> FloatArray:
    """Return the acceleration of every axis, shape (m,): both kernels above in one call."""
    walls = funnel_walls(time, slice_lower, slice_upper, goal_lower, goal_upper, decay_rate, smooth)
    return track_walls(position, rate, walls, log_gain, position_gain, rate_gain)[0]


@compiled
def track_row(row: FloatArray, time: float, position: float, rate: float) -> tuple[float, float]:
    """Return acceleration and energy of one axis from its row of a table, see ``LAW_COLUMNS``."""
    value, first, second = decay(time, row[4], row[5] != 0.0)
    below, above = row[0] - row[2], row[1] - row[3]
    return track_axis(
        position,
        rate,
        row[2] + below * value,
        row[3] + above * value,
        below * first,
        above * first,
        below * second,
        above * second,
        row[6],
        row[7],
        row[8],
    )


@compiled
def track_cell(
    tables: FloatArray, current_cell: FloatArray, now: float, thing: FloatArray, robot: FloatArray,
    acceleration: FloatArray,
) -> bool:  # fmt: skip
    """Write the accelerations of the object's angle and one robot's joints in the current cell.

    Args:
        tables: The tables of the axes (theta, q_k) in all cells, shape (cells, 1 + n, ``LAW_COLUMNS``).
        current_cell: Index of the current cell, time of its entry [-, s].
        now: Time [s].
        thing: Pose and twist of the object, shape (6,).
        robot: (z_k, z_k'), shape (2 (3 + n),).
        acceleration: Receives the accelerations, shape (1 + n,).

    Returns:
        Whether there is such a cell; nothing is written otherwise.
    """
    index, n = int(current_cell[0]), tables.shape[1] - 1
    if not 0 <= index < tables.shape[0]:
        return False
    table, time = tables[index], now - current_cell[1]
    acceleration[0] = track_row(table[0], time, thing[2], thing[5])[0]
    for i in range(n):
        acceleration[1 + i] = track_row(table[1 + i], time, robot[3 + i], robot[6 + n + i])[0]
    return True


@compiled
def hand_command(
    share: FloatArray, state: FloatArray, ax: float, ay: float, alpha: float, command: FloatArray
) -> None:
    """Write the acceleration of a grasp, then its wrench on the object; see ``load_sharing``.

    Args:
        share: (p_LE, p_LLcm, mass, inertia, the robot's part of the work), shape (7,).
        state: Pose and twist of the object, shape (6,).
        ax: Desired acceleration of the object's origin along x ...
        ay: ... and along y [m/s^2].
        alpha: Desired angular acceleration [rad/s^2].
        command: Receives both, shape (6,).
    """
    c, s, turning = np.cos(state[2]), np.sin(state[2]), state[5] * state[5]
    rx, ry = c * share[0] - s * share[1], s * share[0] + c * share[1]
    mx, my = c * share[2] - s * share[3], s * share[2] + c * share[3]
    command[0] = ax - alpha * ry - turning * rx
    command[1] = ay + alpha * rx - turning * ry
    command[2] = alpha
    fx = share[6] * share[4] * (ax - alpha * my - turning * mx)
    fy = share[6] * share[4] * (ay + alpha * mx - turning * my)
    command[3], command[4] = fx, fy
    command[5] = share[6] * share[5] * alpha - (my - ry) * fx + (mx - rx) * fy


@compiled
def command_hand(
    share: FloatArray, state: FloatArray, governor: FloatArray, axes: FloatArray, command: FloatArray
) -> None:
    """Write what ``hand_command`` does from a governor's command, shape (4,), and accelerations of axes."""
    hand_command(share, state, governor[2], governor[3], axes[0], command)


@compiled
def governed_acceleration(
    state: FloatArray, governor: FloatArray, stiffness: float, damping: float, acceleration: FloatArray
) -> None:
    """Write -K (p - p_G) - zeta p' of (14) from the object's state, shape (2,)."""
    for i in range(2):
        acceleration[i] = -stiffness * (state[i] - governor[i]) - damping * state[3 + i]


@compiled
def governor_velocity(
    vx: float, vy: float, margin: float, stiffness: float, gain: float, smoothing: float, velocity: FloatArray
) -> None:
    """Write p_G' = K_G v^ min(|v|, root(Delta E / K)) of (14); see ``governor``."""
    length = np.hypot(vx, vy)
    if margin <= 0.0 or length == 0.0:
        velocity[0], velocity[1] = 0.0, 0.0
        return
    root = np.sqrt(margin / stiffness + smoothing * smoothing) - smoothing
    scale = gain * min(1.0, root / length)
    velocity[0], velocity[1] = scale * vx, scale * vy


@compiled
def interval_margin(position: FloatArray, lower: FloatArray, upper: FloatArray, erosion: float) -> float:
    """Return the smallest 1 - |x - middle| / half of all axes, the intervals eroded; see ``ready``."""
    margin = np.inf
    for i in range(position.size):
        half = 0.5 * (upper[i] - lower[i]) * (1.0 - 2.0 * erosion)
        margin = min(margin, 1.0 - abs(position[i] - 0.5 * (lower[i] + upper[i])) / half)
    return margin


@compiled
def funnel_margin(
    slice_lower: FloatArray,
    slice_upper: FloatArray,
    goal_lower: FloatArray,
    goal_upper: FloatArray,
    decay_rate: FloatArray,
    smooth: bool,
    position: FloatArray,
    rate: FloatArray,
    log_gain: FloatArray,
    position_gain: float,
    bound: FloatArray,
) -> float:
    """Return the smallest (bound - V) / max(V, bound) of all axes when their funnels begin; see ``ready``."""
    walls = funnel_walls(0.0, slice_lower, slice_upper, goal_lower, goal_upper, decay_rate, smooth)
    energy = track_walls(position, rate, walls, log_gain, position_gain, 0.0)[1]
    margin = np.inf
    for i in range(position.size):
        margin = min(margin, (bound[i] - energy[i]) / max(energy[i], bound[i]))
    return margin


@compiled
def write_walls(rows: FloatArray, time: float, walls: FloatArray) -> None:
    """Write the lower, then the upper walls of all axes, shape (2 m,)."""
    m = rows.shape[0]
    for i in range(m):
        value = decay(time, rows[i, 4], rows[i, 5] != 0.0)[0]
        walls[i] = rows[i, 2] + (rows[i, 0] - rows[i, 2]) * value
        walls[m + i] = rows[i, 3] + (rows[i, 1] - rows[i, 3]) * value
