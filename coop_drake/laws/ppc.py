"""Prescribed performance control of the object's angle and of every joint, (18)-(20) and (35)-(38)."""

from __future__ import annotations

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.funnels import FunnelBounds
from coop_drake.tree.pose import FloatArray

SATURATION = 1e-7
"""Smallest distance to a funnel bound that the law as printed computes with, over the funnel's width [-].
Trial steps of an integrator may end nearer or outside: the law must then point back inside and must not grow
with the distance, or the next trial step would overflow."""


@compiled
def ramped_gain(time: float, gain: float, ramp_rate: float) -> tuple[float, float]:
    """Return k1(t) = k1 (1 - (1 + mu t) e^(-mu t)) and its derivative [1/s, 1/s^2].

    Both begin at zero, so that an axis that enters a cell at rest is not thrown towards the funnel's middle.

    Args:
        time: t >= 0 since the cell was entered [s].
        gain: k1, the value in the limit [1/s].
        ramp_rate: mu [1/s]; for 0 the gain is k1 from the beginning.
    """
    if ramp_rate == 0.0:
        return gain, 0.0
    left = np.exp(-ramp_rate * time)
    return gain * (1.0 - (1.0 + ramp_rate * time) * left), gain * ramp_rate * ramp_rate * time * left


@compiled(borrows=True)
def track_axis(
    position: float,
    rate: float,
    bounds: tuple[float, float, float, float, float, float],
    gains: tuple[float, float, float, float, float],
) -> tuple[float, float]:
    """Return the acceleration x'' that keeps one axis in its funnel, and its energy V.

    With dl = x - rho_l, du = rho_u - x, w = dl + du, s = ln(dl / du) and a = w / (dl du), the back-stepping
    law of (18)-(20) and (35)-(38), errata E18, E20 and E35, is

        v   = (rho_l' du + rho_u' dl - k1 s dl du) / w
        x'' = -k2 (x' - v) + v' - kappa a s

    and the energy V = kappa s^2 / 2 + (x' - v)^2 / 2 of (41) and (48) decays with
    V' = -kappa k1 s^2 - k2 (x' - v)^2, also while k1 changes, because v' holds its rate k1'. The distances dl
    and du saturate: an axis that is nearer to a bound than a share of the width, or outside, counts as this
    far inside. Where they do, V is no longer sure to decay, and the law stays bounded.

    Args:
        position: x [rad or m].
        rate: x' [rad/s or m/s].
        bounds: rho_l, rho_u, their rates and their accelerations, as ``axis_bounds`` returns them.
        gains: kappa [rad^2/s^2 or m^2/s^2], k1 now [1/s], k1' now [1/s^2], k2 [1/s], and the smallest
            distance to a bound over the funnel's width [-].

    Returns:
        x'' [rad/s^2 or m/s^2] and V [rad^2/s^2 or m^2/s^2].
    """
    w, saturation = bounds[1] - bounds[0], gains[4]
    near, far = saturation * w, (1.0 - saturation) * w
    dl = min(max(position - bounds[0], near), far)
    du = min(max(bounds[1] - position, near), far)
    return track_distances(dl, du, np.log(dl / du), rate, bounds, gains)


@compiled(borrows=True)
def track_distances(
    dl: float,
    du: float,
    s: float,
    rate: float,
    bounds: tuple[float, float, float, float, float, float],
    gains: tuple[float, float, float, float, float],
) -> tuple[float, float]:
    """Return ``track_axis`` for saturated distances dl and du [rad or m] and s = ln(dl / du)."""
    lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration = bounds
    log_gain, k1, k1_dot, k2, _ = gains
    w, w_dot = upper - lower, upper_rate - lower_rate
    dl_dot, du_dot = rate - lower_rate, upper_rate - rate
    s_dot = dl_dot / dl - du_dot / du
    a = w / (dl * du)
    v = (lower_rate * du + upper_rate * dl - k1 * s * dl * du) / w
    v_dot = (
        lower_acceleration * du
        + lower_rate * du_dot
        + upper_acceleration * dl
        + upper_rate * dl_dot
        - k1 * (s_dot * dl * du + s * (dl_dot * du + dl * du_dot))
        - k1_dot * s * dl * du
        - v * w_dot
    ) / w
    acceleration = -k2 * (rate - v) + v_dot - log_gain * a * s
    return acceleration, 0.5 * log_gain * s * s + 0.5 * (rate - v) * (rate - v)


def prescribed_acceleration(
    position: FloatArray,
    rate: FloatArray,
    bounds: FunnelBounds,
    *,
    log_gain: FloatArray,
    position_gain: float,
    rate_gain: float,
    position_gain_rate: float = 0.0,
    saturation: float = SATURATION,
) -> FloatArray:
    """Return the acceleration of ``track_axis`` for every axis, shape (m,).

    Args:
        position: x of every axis, shape (m,) [rad or m].
        rate: x' of every axis, shape (m,).
        bounds: Funnel bounds now.
        log_gain: kappa of every axis, shape (m,) [rad^2/s^2 or m^2/s^2].
        position_gain: k1 now [1/s].
        rate_gain: k2 [1/s].
        position_gain_rate: k1' now [1/s^2].
        saturation: Smallest distance to a bound, over the width [-].
    """
    gains = position_gain, position_gain_rate, rate_gain, saturation
    return _track(position, rate, bounds, log_gain, gains)[:, 0]


def prescribed_energy(
    position: FloatArray,
    rate: FloatArray,
    bounds: FunnelBounds,
    *,
    log_gain: FloatArray,
    position_gain: float,
) -> FloatArray:
    """Return the energy V of ``track_axis`` for every axis, shape (m,); arguments as above."""
    return _track(position, rate, bounds, log_gain, (position_gain, 0.0, 0.0, SATURATION))[:, 1]


def _track(
    position: FloatArray,
    rate: FloatArray,
    bounds: FunnelBounds,
    log_gain: FloatArray,
    gains: tuple[float, float, float, float],
) -> FloatArray:
    """Return acceleration and energy of every axis, shape (m, 2)."""
    others = tuple(float(gain) for gain in gains)
    return np.array(
        [
            track_axis(x, v, axis, (kappa, *others))
            for x, v, axis, kappa in zip(position, rate, zip(*bounds, strict=True), log_gain, strict=True)
        ]
    )
