"""The law of one axis, for many axes at once."""

from __future__ import annotations

import numpy as np

from coop_drake.laws.ppc import SATURATION, FunnelBounds, track_axis
from coop_drake.tree.arrays import FloatArray


def prescribed_acceleration(
    position: FloatArray, rate: FloatArray, bounds: FunnelBounds, *, log_gain: FloatArray,
    position_gain: float, rate_gain: float, position_gain_rate: float = 0.0, saturation: float = SATURATION,
) -> FloatArray:  # fmt: skip
    """The acceleration of ``track_axis`` for every axis, shape (m,).

    Args:
        position, rate: x and x' of every axis, shape (m,) [rad or m, per s].
        bounds: Funnel bounds now.
        log_gain: kappa of every axis, shape (m,) [rad^2/s^2 or m^2/s^2].
        position_gain, position_gain_rate: k1 [1/s] and k1' [1/s^2] now.
        rate_gain: k2 [1/s].
        saturation: Smallest distance to a bound, over the width [-].
    """
    gains = position_gain, position_gain_rate, rate_gain, saturation
    return tracked(position, rate, bounds, log_gain, gains)[:, 0]


def prescribed_energy(
    position: FloatArray,
    rate: FloatArray,
    bounds: FunnelBounds,
    *,
    log_gain: FloatArray,
    position_gain: float,
) -> FloatArray:
    """The energy V of ``track_axis`` for every axis, shape (m,); arguments as above."""
    return tracked(position, rate, bounds, log_gain, (position_gain, 0.0, 0.0, SATURATION))[:, 1]


def tracked(position, rate, bounds, log_gain, gains) -> FloatArray:
    """Acceleration and energy of every axis, shape (m, 2)."""
    others, axes = tuple(map(float, gains)), zip(*bounds, strict=True)
    rows = zip(position, rate, axes, log_gain, strict=True)
    return np.array([track_axis(x, v, axis, (kappa, *others)) for x, v, axis, kappa in rows])
