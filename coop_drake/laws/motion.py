"""The nominal motion of a team that passes from cell to cell, and the feedback that keeps the team on it.

All robots know the motion z(sigma), a spline, and follow it at the same phase sigma, whose rate is the pace
rho, 1 but where the team brakes or starts. The desired acceleration of every axis x of (x, y, theta, q) is
the nominal one and a proportional-derivative feedback,

x^'' - K_t (x - x^) - zeta_t (x' - x^'),  x^' = rho z',  x^'' = rho^2 z'' + rho' z',

so that its departure from the motion (the tracking error) obeys a linear equation that does not vary in time.
"""

from __future__ import annotations

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray


@compiled
def motion_at(
    points: FloatArray, period: float, phase: float, pace: float, pace_rate: float, nominal: FloatArray
) -> None:
    """Write the nominal configuration, its rate and its acceleration.

    Args:
        points: Control points of a cubic B-spline with equal spans, shape (m, d).
        period: Time of a span [s].
        phase: sigma; before the beginning and after the end the motion is at rest [s].
        pace: rho [-].
        pace_rate: rho' [1/s].
        nominal: Receives x^, x^' and x^'', shape (3, d).
    """
    spans = points.shape[0] - 3
    place = min(max(phase / period, 0.0), float(spans))
    span = min(int(place), spans - 1)
    u = place - span
    w = 1.0 - u
    for k in range(points.shape[1]):
        a, b, c, d = points[span, k], points[span + 1, k], points[span + 2, k], points[span + 3, k]
        value = w**3 * a + (3.0 * u**3 - 6.0 * u * u + 4.0) * b + (3.0 * w**3 - 6.0 * w * w + 4.0) * c
        rate = (0.5 * (w * w * (b - a) + u * u * (d - c)) + (0.5 + u * w) * (c - b)) / period
        nominal[0, k] = (value + u**3 * d) / 6.0
        nominal[1, k] = pace * rate
        bend = (w * (a - 2.0 * b + c) + u * (b - 2.0 * c + d)) / (period * period)
        nominal[2, k] = pace * pace * bend + pace_rate * rate


@compiled(borrows=True)
def pulled(
    nominal: FloatArray, axis: int, position: float, rate: float, stiffness: float, damping: float
) -> float:
    """Return the desired acceleration of an axis.

    Args:
        nominal: What ``motion_at`` writes.
        axis: Index of the axis in (x, y, theta, q).
        position: Its position as measured [m or rad].
        rate: Its rate as measured.
        stiffness: K_t [1/s^2].
        damping: zeta_t [1/s].
    """
    off, fast = position - nominal[0, axis], rate - nominal[1, axis]
    return float(nominal[2, axis] - stiffness * off - damping * fast)
