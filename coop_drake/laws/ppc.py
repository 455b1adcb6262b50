"""Prescribed performance control of the object's angle and of every joint, (18)-(20) and (35)-(38)."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.funnels import Funnel, FunnelBounds, funnel_bounds
from coop_drake.laws.gains import FloatArray

__all__ = [
    "SATURATION",
    "funnel_acceleration",
    "prescribed_acceleration",
    "prescribed_energy",
    "track_axis",
]

SATURATION = 1e-7
"""Smallest distance to a funnel bound that the law computes with, over the funnel's width [-]. An axis that
is nearer, or outside, counts as this far inside. Trial steps of an integrator may end there: the law must
then point back inside and must not grow with the distance, or the next trial step would overflow."""


@compiled
def track_axis(
    position: float,
    rate: float,
    bounds: tuple[float, float, float, float, float, float],
    log_gain: float,
    position_gain: float,
    rate_gain: float,
) -> tuple[float, float]:
    """Return the acceleration x'' that keeps one axis in its funnel, and its energy V.

    With dl = x - rho_l, du = rho_u - x, w = dl + du, s = ln(dl / du) and a = w / (dl du), the back-stepping
    law of (18)-(20) and (35)-(38), errata E18, E20 and E35, is

        v   = (rho_l' du + rho_u' dl - k1 s dl du) / w
        x'' = -k2 (x' - v) + v' - kappa a s

    and the energy V = kappa s^2 / 2 + (x' - v)^2 / 2 of (41) and (48) decays with
    V' = -kappa k1 s^2 - k2 (x' - v)^2. The distances dl and du saturate, see ``SATURATION``.

    Args:
        position: x [rad or m].
        rate: x' [rad/s or m/s].
        bounds: rho_l, rho_u, their rates and their accelerations, as ``axis_bounds`` returns them.
        log_gain: kappa [rad^2/s^2 or m^2/s^2].
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].

    Returns:
        x'' [rad/s^2 or m/s^2] and V [rad^2/s^2 or m^2/s^2].
    """
    lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration = bounds
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


def prescribed_acceleration(
    position: FloatArray,
    rate: FloatArray,
    bounds: FunnelBounds,
    *,
    log_gain: FloatArray,
    position_gain: float,
    rate_gain: float,
) -> FloatArray:
    """Return the acceleration of ``track_axis`` for every axis, shape (m,).

    Args:
        position: x of every axis, shape (m,) [rad or m].
        rate: x' of every axis, shape (m,).
        bounds: Funnel bounds now.
        log_gain: kappa of every axis, shape (m,) [rad^2/s^2 or m^2/s^2].
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].
    """
    return _track(position, rate, bounds, log_gain, position_gain, rate_gain)[:, 0]


def prescribed_energy(
    position: FloatArray,
    rate: FloatArray,
    bounds: FunnelBounds,
    *,
    log_gain: FloatArray,
    position_gain: float,
) -> FloatArray:
    """Return the energy V of ``track_axis`` for every axis, shape (m,); arguments as above."""
    return _track(position, rate, bounds, log_gain, position_gain, 0.0)[:, 1]


def funnel_acceleration(
    position: FloatArray,
    rate: FloatArray,
    funnel: Funnel,
    time: float,
    *,
    log_gain: FloatArray,
    position_gain: float,
    rate_gain: float,
) -> FloatArray:
    """Return ``prescribed_acceleration`` within ``funnel_bounds(funnel, time)``."""
    bounds = funnel_bounds(funnel, time)
    return _track(position, rate, bounds, log_gain, position_gain, rate_gain)[:, 0]


def _track(
    position: FloatArray,
    rate: FloatArray,
    bounds: FunnelBounds,
    log_gain: FloatArray,
    position_gain: float,
    rate_gain: float,
) -> FloatArray:
    """Return acceleration and energy of every axis, shape (m, 2)."""
    return np.array(
        [
            track_axis(x, v, axis, kappa, float(position_gain), float(rate_gain))
            for x, v, axis, kappa in zip(position, rate, zip(*bounds, strict=True), log_gain, strict=True)
        ]
    )
