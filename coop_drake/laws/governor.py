"""The reference governor of the object's position, equations (14)-(16).

The governor moves a reference point p_G towards the target of the cell. A spring and a damper pull the
object's origin p towards p_G. The governor slows down when the energy of this motion comes near what the
clearance of p_G allows. The controllers, the planner's time estimate, the log, the figures and the tests
all call these functions. One closed form is derived from them by hand and must follow a change:
``steady_clearance``, which a test compares with a run.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray

Value = TypeVar("Value", float, FloatArray)

FIELD_SPEED = 1.0
"""Largest magnitude of the velocity field (13) [m/s]; the governor scales the field and bounds it by Delta
E."""

ATTRACTION_RATE = 30.0
"""Rate at which p_G approaches its target at the end [1/s]: faster than the object follows, and slow enough
for integration steps of 0.02 s. With a larger rate the robots' copies of p_G would drift apart by
rounding."""

AHEAD = 2.0
"""Under a speed limit p_G moves as if the clearance were at most this times ``steady_clearance`` [-]. With 1
the object would approach its largest speed more slowly than without a limit."""

VELOCITY_STEP = 2.0**-26
"""The loop computes the energy from a velocity rounded to a multiple of this [m/s], some 1.5e-8 m/s. Each
robot finds the object's velocity from its own joints, with its own rounding errors; after this rounding all
robots have the same number, and therefore the same p_G, bit by bit."""


def slowdown_radius(max_speed: float, governor_gain: float) -> float:
    """Return the distance from its target at which the field (13) starts to slow down [m].

    Inside it p_G approaches the target like exp(-``ATTRACTION_RATE`` t).

    Args:
        max_speed: Largest magnitude of the field [m/s].
        governor_gain: K_G [-].
    """
    return governor_gain * max_speed / ATTRACTION_RATE


@compiled
def governed_acceleration(
    position: Value, velocity: Value, governor_position: Value, stiffness: float, damping: float
) -> Value:
    """Return one coordinate of the object's desired acceleration, the force of (14) over the mass [m/s^2].

    p'' = -K (p - p_G) - zeta p'. Arrays of equal shape are treated element by element.

    Args:
        position: Coordinate of p, the object's origin in W [m].
        velocity: The same coordinate of p' [m/s].
        governor_position: The same coordinate of p_G [m].
        stiffness: K [1/s^2].
        damping: zeta [1/s].
    """
    return -stiffness * (position - governor_position) - damping * velocity


@compiled
def tracking_energy(x: float, y: float, vx: float, vy: float, stiffness: float) -> float:
    """Return E = (|p'|^2 + K |p - p_G|^2) / 2 of (16) [m^2/s^2].

    Args:
        x: First coordinate of p - p_G in W [m].
        y: Second coordinate of p - p_G [m].
        vx: First coordinate of p' in W [m/s].
        vy: Second coordinate of p' [m/s].
        stiffness: K [1/s^2].
    """
    return 0.5 * (vx * vx + vy * vy + stiffness * (x * x + y * y))


@compiled
def energy_margin(energy: float, clearance: float, stiffness: float) -> float:
    """Return Delta E = K d |d| / 2 - E, (15) corrected: errata E15a and E15b [m^2/s^2].

    While Delta E is not negative, p stays within d of p_G, because K |p - p_G|^2 / 2 <= E <= K d^2 / 2.
    Outside the governed set, where d is negative, Delta E is below -E.

    Args:
        energy: E [m^2/s^2].
        clearance: d, signed distance of p_G to the boundary of the governed set, negative outside it [m].
        stiffness: K [1/s^2].
    """
    return 0.5 * stiffness * clearance * abs(clearance) - energy


@compiled
def steady_clearance(speed: float, stiffness: float, damping: float, governor_gain: float) -> float:
    """Return the clearance in a long aisle with which the governed object has a steady speed [m].

    At a steady speed v the object lags behind p_G by zeta v / K, so that E = v^2 (1 + zeta^2 / K) / 2, and
    v = K_G sqrt(Delta E / K) with Delta E = K d^2 / 2 - E gives
    d = v sqrt((2 K / K_G^2 + 1 + zeta^2 / K) / K).

    Args:
        speed: v [m/s].
        stiffness: K [1/s^2].
        damping: zeta [1/s].
        governor_gain: K_G [-].
    """
    share = 2.0 * stiffness / (governor_gain * governor_gain) + 1.0 + damping * damping / stiffness
    return float(speed * np.sqrt(share / stiffness))


@compiled
def driving_margin(margin: float, clearance: float, steady: float, stiffness: float) -> float:
    """Return Delta E as it would be with a clearance of at most ``AHEAD`` steady ones, which drives p_G.

    p_G so runs not much further ahead of the object than its largest speed needs. That the object stays in
    its cell rests on Delta E itself, and p_G stands still where that is zero [m^2/s^2].

    Args:
        margin: Delta E [m^2/s^2].
        clearance: d, signed distance of p_G to the boundary of the governed set [m].
        steady: ``steady_clearance`` of the largest speed, infinity for none [m].
        stiffness: K [1/s^2].
    """
    most = AHEAD * steady
    if clearance <= most:
        return margin
    return margin - energy_margin(0.0, clearance, stiffness) + energy_margin(0.0, most, stiffness)


@compiled
def governor_velocity(
    vx: float, vy: float, margin: float, stiffness: float, governor_gain: float, smoothing: float
) -> tuple[float, float]:
    """Return p_G' = K_G v^ min(|v|, root(Delta E / K)) of (14), zero where Delta E is not positive [m/s].

    v^ is the direction of the field v. The root is sqrt(x + c^2) - c: for c = 0 as printed, and for c > 0
    Lipschitz continuous at zero.

    Args:
        vx: First coordinate of the field v of (13) at p_G [m/s].
        vy: Second coordinate of v [m/s].
        margin: Delta E [m^2/s^2].
        stiffness: K [1/s^2].
        governor_gain: K_G [-].
        smoothing: c [m].
    """
    length = np.hypot(vx, vy)
    if margin <= 0.0 or length == 0.0:
        return 0.0, 0.0
    root = np.sqrt(margin / stiffness + smoothing * smoothing) - smoothing
    scale = governor_gain * min(1.0, root / length)
    return scale * vx, scale * vy
