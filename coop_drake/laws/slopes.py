"""Slopes of the law of one axis with respect to position and rate, bounded over an interval of positions.

With s, w, k1, k2 and kappa as in ``track_axis``, h = 1 - s tanh(s / 2), and r = (rho_l' du + rho_u' dl) / w,
the rate with which the funnel carries a point along, the acceleration L(t, x, x') of the law is affine in x':

    dL/dx' = -(k2 + k1 h - w'/w)
    dL/dx  = -h (k1 k2 + k1') + k2 w'/w - (w'/w)^2 + w''/w
             - 4 kappa (1 + cosh s)^2 (1 + s tanh(s / 2)) / w^2 - 2 k1 (s + sinh s) (r - x') / w

With q = dl / w the hyperbolic functions are rational: tanh(s / 2) = 2 q - 1, 1 + cosh s = 1 / (2 q (1 - q))
and sinh s = (2 q - 1) / (2 q (1 - q)).
"""

from __future__ import annotations

from math import log

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import (
    LOG_GAIN,
    POSITION_GAIN,
    RAMP_RATE,
    RATE_GAIN,
    SATURATION,
    bounds_of,
)
from coop_drake.laws.ppc import ramped_gain
from coop_drake.tree.pose import FloatArray


@compiled
def product_bounds(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """Return the interval of all products of a number in [a, b] and a number in [c, d]."""
    return min(a * c, a * d, b * c, b * d), max(a * c, a * d, b * c, b * d)


@compiled(borrows=True)
def slope_bounds(
    row: FloatArray, time: float, position: float, reach: float, rate: float
) -> tuple[float, float, float, float]:
    """Return ``slopes_between`` of one axis over an interval of positions.

    Args:
        row: The axis, a row of an ``axis_table``.
        time: Time since the cell was entered [s].
        position: Middle of the interval [rad or m].
        reach: Half of its length [rad or m].
        rate: x' at which dL/dx is taken; dL/dx' does not depend on it [rad/s or m/s].
    """
    bounds, gains = bounds_of(row, time), gains_of(row, time)
    w, lower = bounds[1] - bounds[0], bounds[0]
    first, last = (position - reach - lower) / w, (position + reach - lower) / w
    low, high = saturated(first, gains[4]), saturated(last, gains[4])
    ends = (first, low, log(low / (1.0 - low))), (last, high, log(high / (1.0 - high)))
    return slopes_between(bounds, gains, ends[0], ends[1], rate)


@compiled(borrows=True)
def gains_of(row: FloatArray, time: float) -> tuple[float, float, float, float, float]:
    """Return the gains of one axis as ``track_axis`` takes them: kappa, k1, k1', k2 and the saturation."""
    k1, k1_dot = ramped_gain(time, row[POSITION_GAIN], row[RAMP_RATE])
    return row[LOG_GAIN], k1, k1_dot, row[RATE_GAIN], row[SATURATION]


@compiled
def saturated(place: float, saturation: float) -> float:
    """Return the place dl / w in a funnel, one that is too near to a bound or outside being moved inside."""
    return min(max(place, saturation), 1.0 - saturation)


@compiled(borrows=True)
def slopes_between(
    bounds: tuple[float, float, float, float, float, float],
    gains: tuple[float, float, float, float, float],
    first: tuple[float, float, float],
    last: tuple[float, float, float],
    rate: float,
) -> tuple[float, float, float, float]:
    """Return bounds of dL/dx and dL/dx' over an interval of positions, all formulas being monotone in |s|.

    Where the interval leaves the part of the funnel in which distances do not saturate, dL/dx is 0, and the
    bounds hold that too.

    Args:
        bounds: The funnel's bounds, as ``axis_bounds`` returns them.
        gains: See ``gains_of``.
        first: Lower end of the interval: dl / w, the same where distances saturate, and s = ln(dl / du) [-].
        last: Its upper end, too.
        rate: x' at which dL/dx is taken; dL/dx' does not depend on it [rad/s or m/s].

    Returns:
        Lower and upper bound of dL/dx [1/s^2], lower and upper bound of dL/dx' [1/s].
    """
    lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration = bounds
    kappa, k1, k1_dot, k2, saturation = gains
    w = upper - lower
    closing, bending = (upper_rate - lower_rate) / w, (upper_acceleration - lower_acceleration) / w
    (_, low, s_low), (_, high, s_high) = first, last
    across = s_low <= 0.0 <= s_high
    pulls = s_low * (2.0 * low - 1.0), s_high * (2.0 * high - 1.0)
    pull_near, pull_far = 0.0 if across else min(pulls), max(pulls)
    from_low, from_high = 0.5 / (low * (1.0 - low)), 0.5 / (high * (1.0 - high))
    carried_low = lower_rate + low * (upper_rate - lower_rate) - rate
    carried_high = lower_rate + high * (upper_rate - lower_rate) - rate
    turned = product_bounds(
        s_low + from_low * (2.0 * low - 1.0), s_high + from_high * (2.0 * high - 1.0),
        min(carried_low, carried_high), max(carried_low, carried_high),
    )  # fmt: skip
    spring = product_bounds(1.0 - pull_far, 1.0 - pull_near, k1 * k2 + k1_dot, k1 * k2 + k1_dot)
    closest = 2.0 if across else min(from_low, from_high)
    log_near = 4.0 * kappa / (w * w) * closest * closest * (1.0 + pull_near)
    log_far = 4.0 * kappa / (w * w) * max(from_low, from_high) ** 2 * (1.0 + pull_far)
    steady = k2 * closing - closing * closing + bending
    x_lower = steady - spring[1] - log_far - 2.0 * k1 / w * turned[1]
    x_upper = steady - spring[0] - log_near - 2.0 * k1 / w * turned[0]
    if first[0] < saturation or last[0] > 1.0 - saturation:
        x_lower, x_upper = min(x_lower, 0.0), max(x_upper, 0.0)
    return x_lower, x_upper, closing - k2 - k1 * (1.0 - pull_near), closing - k2 - k1 * (1.0 - pull_far)
