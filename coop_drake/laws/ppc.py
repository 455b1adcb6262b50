"""Prescribed performance control of the object's angle and of every joint, equations (18)-(20) and (35)-(38).

With dl = x - rho_l, du = rho_u - x, w = dl + du, s = ln(dl / du) and a = w / (dl du), the law is

    v   = (rho_l' du + rho_u' dl - k1 s dl du) / w
    x'' = -k2 (x' - v) + v' - kappa a s

and the energy V = kappa s^2 / 2 + (x' - v)^2 / 2 decays: V' = -kappa k1 s^2 - k2 (x' - v)^2. The printed
forms need the errata E18, E20 and E35.
Distances to a wall saturate at 1e-7 w and (1 - 1e-7) w, so that every state has an answer, also outside the
funnel: that of an axis just inside the wall.
"""

from __future__ import annotations

from coop_drake.laws import kernels
from coop_drake.laws.funnels import Funnel, FunnelWalls
from coop_drake.laws.gains import FloatArray


def prescribed_acceleration(
    position: FloatArray,
    rate: FloatArray,
    walls: FunnelWalls,
    *,
    log_gain: FloatArray,
    position_gain: float,
    rate_gain: float,
) -> FloatArray:
    """Return the acceleration that keeps every axis between its walls.

    Args:
        position: x of every axis, shape (m,) [rad or m].
        rate: x' of every axis, shape (m,).
        walls: Walls and their derivatives now.
        log_gain: kappa of every axis, shape (m,) [rad^2/s^2 or m^2/s^2].
        position_gain: k1 [1/s].
        rate_gain: k2 [1/s].

    Returns:
        x'' of every axis, shape (m,).
    """
    acceleration, _ = kernels.track_walls(position, rate, walls, log_gain, position_gain, rate_gain)
    return acceleration


def prescribed_energy(
    position: FloatArray,
    rate: FloatArray,
    walls: FunnelWalls,
    *,
    log_gain: FloatArray,
    position_gain: float,
) -> FloatArray:
    """Return V of every axis, shape (m,), the function of (41) and (48) with kappa; arguments as above."""
    _, energy = kernels.track_walls(position, rate, walls, log_gain, position_gain, 0.0)
    return energy


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
    """Return ``prescribed_acceleration`` between ``funnel_walls(funnel, time)``, in one call for the loop."""
    return kernels.track_funnel(
        float(time), *funnel.kernel_arguments, position, rate, log_gain, position_gain, rate_gain
    )
