"""Compiled inner loop of the estimate: a point mass behind its governor along a path, axes in their funnels.

The laws are those of ``control``: (14)-(16) for the position, (18)-(20) for every axis, and its conditions of
readiness. Only the direction of p_G is not: it follows a path where the closed loop follows a harmonic map.
"""

from __future__ import annotations

from math import hypot, sqrt

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.geometry.boundary import signed_distance
from coop_drake.laws.kernels import SATURATION, decay, track_axis
from coop_drake.laws.ready import CLEARANCE_FRACTION, EROSION
from coop_drake.tree.pose import FloatArray

__all__ = ["cross_cell"]

PERIOD = 0.02
"""Readiness is judged once in so long [s]: the longest step that a simulator takes by default."""

STEP_PER_PERIOD = 0.6
"""Longest step of the integration, over the shortest period of the motion through 2 pi [-]."""

FEWEST_STEPS, MOST_STEPS = 2, 200
"""Steps of the integration between two judgements."""

LOOKAHEAD = 0.5
"""The governor steers to the point of its path that lies this share of its clearance ahead [-]."""

SHORTEST_LOOKAHEAD = 2e-3
"""And at least so far ahead [m]."""

SPEED_TOLERANCE, RATE_TOLERANCE = 0.01, 0.02
"""Motion counts as ended below these [m/s, rad/s or m/s], as in ``arrival_margin``."""


@compiled
def _steer(path: FloatArray, x: float, y: float, ahead: float, radius: float) -> tuple[float, float, float]:
    """Direction from a point along a path, and its length: 1 but near the path's end, as the field (13)."""
    nearest, segment, share = np.inf, 0, 0.0
    for k in range(path.shape[0] - 1):
        dx, dy = path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1]
        squared = dx * dx + dy * dy
        s = ((x - path[k, 0]) * dx + (y - path[k, 1]) * dy) / squared if squared > 0.0 else 0.0
        s = min(max(s, 0.0), 1.0)
        away = hypot(x - path[k, 0] - s * dx, y - path[k, 1] - s * dy)
        if away <= nearest:
            nearest, segment, share = away, k, s
    k = segment
    left = ahead + share * hypot(path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1])
    aim_x, aim_y = path[-1, 0], path[-1, 1]
    while k < path.shape[0] - 1:
        length = hypot(path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1])
        if left <= length and length > 0.0:
            aim_x = path[k, 0] + left / length * (path[k + 1, 0] - path[k, 0])
            aim_y = path[k, 1] + left / length * (path[k + 1, 1] - path[k, 1])
            break
        left -= length
        k += 1
    ux, uy = aim_x - x, aim_y - y
    norm = hypot(ux, uy)
    if norm == 0.0:
        return 0.0, 0.0, 0.0
    speed = min(1.0, hypot(path[-1, 0] - x, path[-1, 1] - y) / radius)
    return ux / norm, uy / norm, speed


@compiled
def _rates(
    state: FloatArray,
    time: float,
    edges: FloatArray,
    path: FloatArray,
    governor: FloatArray,
    axes: FloatArray,
    result: FloatArray,
) -> None:
    """Rates of (p, p', p_G, axes, axis rates); ``governor`` and ``axes`` as in ``cross_cell``."""
    stiffness, damping, gain, smoothing, radius = (
        governor[0],
        governor[1],
        governor[2],
        governor[3],
        governor[4],
    )
    ex, ey = state[0] - state[4], state[1] - state[5]
    clearance = signed_distance(edges, state[4], state[5])
    energy = 0.5 * (state[2] * state[2] + state[3] * state[3] + stiffness * (ex * ex + ey * ey))
    margin = 0.5 * stiffness * clearance * abs(clearance) - energy
    result[0], result[1] = state[2], state[3]
    result[2] = -stiffness * ex - damping * state[2]
    result[3] = -stiffness * ey - damping * state[3]
    result[4], result[5] = 0.0, 0.0
    if margin > 0.0:
        ahead = max(LOOKAHEAD * clearance, SHORTEST_LOOKAHEAD)
        ux, uy, speed = _steer(path, state[4], state[5], ahead, radius)
        speed = gain * min(speed, sqrt(margin / stiffness + smoothing * smoothing) - smoothing)
        result[4], result[5] = speed * ux, speed * uy
    m = axes.shape[1]
    smooth = governor[5] > 0.5
    for i in range(m):
        value, first, second = decay(time, axes[4, i], smooth)
        below, above = axes[0, i] - axes[2, i], axes[1, i] - axes[3, i]
        acceleration, _ = track_axis(
            state[6 + i],
            state[6 + m + i],
            axes[2, i] + below * value,
            axes[3, i] + above * value,
            below * first,
            above * first,
            below * second,
            above * second,
            axes[5, i],
            governor[6],
            governor[7],
        )
        result[6 + i], result[6 + m + i] = state[6 + m + i], acceleration


@compiled
def _axes_inside(state: FloatArray, axes: FloatArray) -> bool:
    """Whether every axis is inside its goal interval eroded."""
    for i in range(axes.shape[1]):
        half = 0.5 * (axes[3, i] - axes[2, i])
        if abs(state[6 + i] - axes[2, i] - half) > (1.0 - 2.0 * EROSION) * half:
            return False
    return True


@compiled
def _ready(
    state: FloatArray,
    axes: FloatArray,
    inradius: float,
    next_edges: FloatArray,
    next_governor: FloatArray,
    next_axes: FloatArray,
) -> bool:
    """The conditions of ``ready_margin`` of all robots together."""
    if not _axes_inside(state, axes):
        return False
    stiffness = next_governor[0]
    ex, ey = state[0] - state[4], state[1] - state[5]
    clearance = signed_distance(next_edges, state[4], state[5])
    energy = 0.5 * (state[2] * state[2] + state[3] * state[3] + stiffness * (ex * ex + ey * ey))
    floor = 0.5 * stiffness * (CLEARANCE_FRACTION * inradius) ** 2
    if 0.5 * stiffness * clearance * abs(clearance) - energy < floor:
        return False
    m = axes.shape[1]
    smooth = next_governor[5] > 0.5
    for i in range(m):
        _, first, second = decay(0.0, next_axes[4, i], smooth)
        below, above = next_axes[0, i] - next_axes[2, i], next_axes[1, i] - next_axes[3, i]
        _, energy = track_axis(
            state[6 + i],
            state[6 + m + i],
            next_axes[0, i],
            next_axes[1, i],
            below * first,
            above * first,
            below * second,
            above * second,
            next_axes[5, i],
            next_governor[6],
            next_governor[7],
        )
        if energy > next_axes[6, i]:
            return False
    return True


@compiled
def _arrived(state: FloatArray, axes: FloatArray, target: FloatArray, tolerance: float) -> bool:
    """The conditions of ``arrival_margin``."""
    if hypot(state[0] - target[0], state[1] - target[1]) > (1.0 - EROSION) * tolerance:
        return False
    fastest = 0.0
    for i in range(axes.shape[1]):
        fastest = max(fastest, abs(state[6 + axes.shape[1] + i]))
    at_rest = hypot(state[2], state[3]) <= SPEED_TOLERANCE and fastest <= RATE_TOLERANCE
    return at_rest and _axes_inside(state, axes)


@compiled
def _steps(state: FloatArray, time: float, governor: FloatArray, axes: FloatArray) -> int:
    """Steps until the next judgement: enough for the stiffest part of the motion as it is now."""
    fastest = max(sqrt(governor[0]), governor[2] / governor[4])
    for i in range(axes.shape[1]):
        value, _, _ = decay(time, axes[4, i], governor[5] > 0.5)
        lower = axes[2, i] + (axes[0, i] - axes[2, i]) * value
        upper = axes[3, i] + (axes[1, i] - axes[3, i]) * value
        width = upper - lower
        dl = min(max(state[6 + i] - lower, SATURATION * width), width)
        du = min(max(upper - state[6 + i], SATURATION * width), width)
        steepness = width / (dl * du)
        fastest = max(fastest, steepness * sqrt(axes[5, i] * (1.0 + abs(np.log(dl / du)))))
    return int(min(max(np.ceil(PERIOD * fastest / STEP_PER_PERIOD), FEWEST_STEPS), MOST_STEPS))


@compiled
def cross_cell(
    state: FloatArray,
    edges: FloatArray,
    path: FloatArray,
    governor: FloatArray,
    axes: FloatArray,
    inradius: float,
    next_edges: FloatArray,
    next_governor: FloatArray,
    next_axes: FloatArray,
    last: bool,
    time_limit: float,
) -> float:
    """Integrate one transition from a state until it is left, and leave the state there.

    Args:
        state: (p, p', p_G, axes, axis rates), shape (6 + 2 m,) [m, m/s, rad]; changed in place.
        edges: Edges of Q, shape (e, 4) [m].
        path: The way to the target, shape (k, 2) [m].
        governor: (K, zeta, K_G, c, slowdown radius, smooth funnel or not, k1, k2), shape (8,).
        axes: Rows slice lower, slice upper, goal lower, goal upper, lambda, kappa, V bound, shape (7, m).
        inradius: R [m].
        next_edges: The next cell's edges.
        next_governor: Its ``governor``.
        next_axes: Its ``axes``.
        last: Whether the object shall come to rest here; the next cell's data are not looked at.
        time_limit: Longest time [s].

    Returns:
        Time that passed [s]; infinite beyond the limit.
    """
    n = state.size
    k1, k2, k3, k4 = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    time = 0.0
    while time <= time_limit:
        if last:
            if _arrived(state, axes, path[-1], inradius):
                return time
        elif _ready(state, axes, inradius, next_edges, next_governor, next_axes):
            return time
        steps = _steps(state, time, governor, axes)
        h = PERIOD / steps
        for k in range(steps):
            t = time + k * h
            _rates(state, t, edges, path, governor, axes, k1)
            _rates(state + 0.5 * h * k1, t + 0.5 * h, edges, path, governor, axes, k2)
            _rates(state + 0.5 * h * k2, t + 0.5 * h, edges, path, governor, axes, k3)
            _rates(state + h * k3, t + h, edges, path, governor, axes, k4)
            state += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        time += PERIOD
    return np.inf
