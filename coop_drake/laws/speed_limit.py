"""Speed limits of the object and of the axes, kept by extra damping near a limit.

With the acceleration a that the other laws ask for, and the velocity v, the damping sigma >= 0 is the least
for which

    (a - sigma v) . v <= g (L^2 - |v|^2) / 2.

Then h = (L^2 - |v|^2) / 2 obeys h' >= -g h: a speed that begins below its limit L stays below it. At half
the limit and less, the law leaves room for accelerations of g L and more.

Extra damping takes energy from the object: E of (16) falls by sigma |p'|^2 besides, and Delta E of (15)
stays positive as it does without a limit. An axis in its funnel gets -sigma x' (x' - v) besides in V' of
``track_axis``, which is not positive where x' has the direction of v and is at least as large. While x' is
smaller, the law without a limit asks for k2 (v - x') + v' - kappa a s, and no damping is needed as long as
g >= k2 and v' - kappa a s <= g (L - v): V decays as it does without a limit where the funnel is slow
against L. ``FUNNEL_SHARE`` sees to that.
"""

from __future__ import annotations

from math import inf

from coop_drake.jit import compiled
from coop_drake.laws.funnels import CLOSING, STEEPEST

__all__ = ["FUNNEL_SHARE", "damped", "funnel_rate", "slowed_decay_rate", "speed_damping"]

FUNNEL_SHARE = 0.8
"""Largest rate of a funnel's bound over the limit of its axis [-]: an axis must be able to move away from a
bound that follows it."""


@compiled
def speed_damping(power: float, speed_squared: float, limit: float, gain: float) -> float:
    """Return sigma, the extra damping that keeps a speed below its limit [1/s].

    Args:
        power: a . v [m^2/s^3 or rad^2/s^3].
        speed_squared: |v|^2 [m^2/s^2 or rad^2/s^2].
        limit: L; infinity for none [m/s or rad/s].
        gain: g, the rate at which a speed may approach its limit [1/s].
    """
    excess = power - 0.5 * gain * (limit * limit - speed_squared)
    return excess / speed_squared if excess > 0.0 and speed_squared > 0.0 else 0.0


@compiled
def damped(acceleration: float, rate: float, limit: float, gain: float) -> float:
    """Return a - sigma x' of one axis [rad/s^2 or m/s^2].

    Args:
        acceleration: a [rad/s^2 or m/s^2].
        rate: x' [rad/s or m/s].
        limit: L; infinity for none [rad/s or m/s].
        gain: g [1/s].
    """
    return acceleration - speed_damping(acceleration * rate, rate * rate, limit, gain) * rate


@compiled
def funnel_rate(decay_rate: float, shrink: float, quintic: bool) -> float:
    """Return the largest rate of a funnel's bound [rad/s or m/s].

    Args:
        decay_rate: lambda [1/s].
        shrink: Distance that the bound moves [rad or m].
        quintic: Whether the funnel is quintic.
    """
    return decay_rate * shrink * (STEEPEST / CLOSING if quintic else 1.0)


@compiled
def slowed_decay_rate(decay_rate: float, shrink: float, quintic: bool, limit: float) -> float:
    """Return lambda, or less where a bound would move faster than ``FUNNEL_SHARE`` of the axis's limit [1/s].

    Args:
        decay_rate: lambda without a limit [1/s].
        shrink: Distance that the faster bound moves [rad or m].
        quintic: Whether the funnel is quintic.
        limit: L; infinity for none [rad/s or m/s].
    """
    if limit == inf or shrink <= 0.0:
        return decay_rate
    return min(decay_rate, FUNNEL_SHARE * limit / funnel_rate(1.0, shrink, quintic))
