"""The reference governor of the object's position, equations (14)-(16)."""

from __future__ import annotations

import numpy as np

from coop_drake.laws import kernels
from coop_drake.laws.gains import FloatArray

ATTRACTION_RATE = 30.0
"""Rate at which p_G is drawn into its target [1/s]: faster than the object follows, slow enough for steps of
0.02 s; a field that slows down only close to its target makes copies of p_G drift apart by its stiffness."""


def slowdown_radius(max_speed: float, *, governor_gain: float) -> float:
    """Return the distance from its target at which the field (13) starts to slow down [m].

    Inside it p_G approaches the target like exp(-``ATTRACTION_RATE`` t).

    Args:
        max_speed: Largest magnitude of the field [m/s].
        governor_gain: K_G [-].
    """
    return governor_gain * max_speed / ATTRACTION_RATE


def governed_acceleration(
    position: FloatArray,
    velocity: FloatArray,
    governor_position: FloatArray,
    *,
    stiffness: float,
    damping: float,
) -> FloatArray:
    """Return the object's desired acceleration, the force of (14) over the mass: -K (p - p_G) - zeta p'.

    Args:
        position: p of the object's origin in W, shape (2,) [m].
        velocity: p', shape (2,) [m/s].
        governor_position: p_G in W, shape (2,) [m].
        stiffness: K [1/s^2].
        damping: zeta [1/s].

    Returns:
        p'', shape (2,) [m/s^2].
    """
    return -stiffness * (position - governor_position) - damping * velocity


def tracking_energy(
    position: FloatArray, velocity: FloatArray, governor_position: FloatArray, *, stiffness: float
) -> float:
    """Return E = (|p'|^2 + K |p - p_G|^2) / 2 of (16) [m^2/s^2]; arguments as above."""
    x, y = position[0] - governor_position[0], position[1] - governor_position[1]
    return float(0.5 * (velocity[0] ** 2 + velocity[1] ** 2 + stiffness * (x * x + y * y)))


def energy_margin(energy: float, clearance: float, *, stiffness: float) -> float:
    """Return Delta E = (K / 2) d^2 - E, (15) corrected: errata E15a and E15b.

    While it is not negative, p stays within d of p_G: K |p - p_G|^2 / 2 <= E <= K d^2 / 2.

    Args:
        energy: E [m^2/s^2].
        clearance: d, signed distance of p_G to the boundary of the safe set, negative outside it [m].
        stiffness: K [1/s^2].

    Returns:
        Delta E; below -E outside the safe set [m^2/s^2].
    """
    return 0.5 * stiffness * clearance * abs(clearance) - energy


def governor_velocity(
    field_velocity: FloatArray, margin: float, *, stiffness: float, governor_gain: float, smoothing: float
) -> FloatArray:
    """Return p_G' = K_G v^ min(|v|, root(Delta E / K)) of (14), zero where Delta E is not positive.

    The root is sqrt(x + c^2) - c: as printed for c = 0, and Lipschitz for c > 0.

    Args:
        field_velocity: v of (13) at p_G, shape (2,).
        margin: Delta E [m^2/s^2].
        stiffness: K [1/s^2].
        governor_gain: K_G.
        smoothing: c [m].

    Returns:
        p_G', shape (2,) [m/s].
    """
    velocity = np.empty(2)
    kernels.governor_velocity(
        field_velocity[0], field_velocity[1], margin, stiffness, governor_gain, smoothing, velocity
    )
    return velocity
