"""The law of many axes at once, written again in the distances to the funnel's bounds.

With dl and du, w = dl + du, s = ln(dl / du), P = s (dl - du) / w, and b, c the rates and accelerations with
which the funnel carries a point along, the acceleration is affine in the rate v,

    L = (k2 + k1 (1 - P) - w'/w) (b - v) + c - s dl du (k1 k2 + k1 w'/w + k1') / w - kappa w s / (dl du)
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from coop_drake.answers.plan import Plan
from coop_drake.tree.pose import FloatArray

PIECES = 16
"""Pieces into which an interval of positions is cut, twice as many as the planner's [-]."""


@dataclass(frozen=True)
class Axes:
    """Funnels and gains of many axes, each array of shape (b,): as in a plan, with the time since the entry.

    Attributes:
        start: Slice, lower and upper ends, shape (2, b) [rad or m].
        goal: Goal interval, lower and upper ends, shape (2, b) [rad or m].
        decay: lambda [1/s].
        kappa: Gain of the log term [rad^2/s^2 or m^2/s^2].
        k1: Position gain in the end [1/s].
        k2: Rate gain [1/s].
        mu: Rate of the ramp of k1 [1/s].
        share: Smallest distance over the width that the law computes with [-].
        fading: Time for which the jump of the command at the switch fades [s].
    """

    start: FloatArray
    goal: FloatArray
    decay: FloatArray
    kappa: FloatArray
    k1: FloatArray
    k2: FloatArray
    mu: FloatArray
    share: FloatArray
    fading: FloatArray

    def __getitem__(self, some: NDArray[np.intp]) -> Axes:
        return Axes(*(getattr(self, field.name)[..., some] for field in fields(self)))

    def bounds(self, time: float | FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the bounds of (17), (39) [rad or m], their rates and their accelerations, (2, b) each.

        Args:
            time: Time since the transition began, one for all axes or shape (b,) [s].
        """
        rate = self.decay / 5.0
        u = np.minimum(time * rate, 1.0)
        left = 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        first, second = (
            -30.0 * rate * (u * (1.0 - u)) ** 2,
            -60.0 * rate**2 * u * (1.0 - 3.0 * u + 2.0 * u**2),
        )
        shrink = self.start - self.goal
        return self.goal + shrink * left, shrink * first, shrink * second

    def left(self, time: float) -> FloatArray:
        """Return the share of the command's jump that is left: 1 at the switch, 0 in the end, (b,) [-]."""
        u = np.minimum(time / np.maximum(self.fading, 1e-12), 1.0)
        return 1.0 - u**3 * (10.0 - 15.0 * u + 6.0 * u**2)

    def ramp(self, time: float | FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return k1 at a time since the transition began [1/s] and its rate [1/s^2], shape (b,) each."""
        gone = np.exp(-self.mu * time)
        ramped = self.mu > 0.0
        value = np.where(ramped, self.k1 * (1.0 - gone - self.mu * time * gone), self.k1)
        return value, np.where(ramped, self.k1 * self.mu**2 * time * gone, 0.0)


def axes_of(plan: Plan, k: int) -> Axes:
    """Return funnels and gains of all axes in a transition."""
    cell, transition = plan.cells[k], plan.transitions[k]
    gains, same = transition.gains, np.ones_like(cell.lower)
    goal = np.array([transition.goal_lower, transition.goal_upper])
    single = (gains.position_gain, gains.rate_gain, gains.ramp_rate, gains.saturation)
    singles = (value * same for value in (*single, gains.hand_over_time))
    return Axes(np.array([cell.lower, cell.upper]), goal, gains.decay_rate, gains.log_gain, *singles)


def law(axes: Axes, time: float, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return the acceleration L at (x, v), shape (b,), a time since the transition began [s]."""
    acceleration: FloatArray = _law(axes, time, x[None], v)[0][0]
    return acceleration


def fit(
    axes: Axes, time: float | FloatArray, x: FloatArray, reach: FloatArray, v: FloatArray
) -> tuple[FloatArray, ...]:
    """Return the acceleration L at (x, v), its linear approximation there, and bounds of the remainder.

    Args:
        axes: Funnels and gains of b axes.
        time: Time since the transition began, one for all axes or shape (b,) [s].
        x: Positions, shape (b,) [rad or m].
        reach: Half the width of the interval of positions about x, shape (b,) [rad or m].
        v: Rates, shape (b,) [rad/s or m/s].

    Returns:
        L(x, v) [rad/s^2 or m/s^2], its slopes by position [1/s^2] and by rate [1/s], the largest remainder
        for all positions within ``reach`` [rad/s^2 or m/s^2], and the largest departure of the slope by rate
        [1/s]; each of shape (b,).
    """
    reach = np.maximum(reach, 1e-9)
    offsets = np.linspace(-1.0, 1.0, PIECES + 1)[:, None] * reach
    L, parts = _law(axes, time, x + offsets, v)
    middle = L[PIECES // 2]
    L = L - middle
    quarter = PIECES // 4
    slope = (L[-1] - L[0] + L[-1 - quarter] - L[quarter]) / (3.0 * reach)
    x_low, x_high, v_low, v_high = _slopes(axes, *parts)
    away = np.abs(L - slope * offsets)
    rest = np.maximum(away[:-1], away[1:]) + 0.25 * (2.0 * reach / PIECES) * (x_high - x_low)
    low, high = v_low.min(axis=0), v_high.max(axis=0)
    return middle, slope, 0.5 * (low + high), rest.max(axis=0), 0.5 * (high - low)


def _law(
    axes: Axes, time: float | FloatArray, x: FloatArray, v: FloatArray
) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """Return L at positions of shape (k, b), and what its slopes are made of."""
    (low, high), (low_rate, high_rate), (low_bend, high_bend) = axes.bounds(time)
    k1, k1_rate = axes.ramp(time)
    w, closing = high - low, (high_rate - low_rate) / (high - low)
    dl = np.clip(x - low, axes.share * w, (1.0 - axes.share) * w)
    du, outside = w - dl, (x - low < axes.share * w) | (high - x < axes.share * w)
    s = np.log(dl / du)
    pulled = s * (dl - du) / w
    carried = (low_rate * du + high_rate * dl) / w - v
    bent = (low_bend * du + high_bend * dl) / w
    damping = axes.k2 + k1 * (1.0 - pulled) - closing
    spring = s * dl * du / w * (k1 * axes.k2 + k1 * closing + k1_rate)
    L = damping * carried + bent - spring - axes.kappa * w * s / (dl * du)
    steady = axes.k2 * closing - closing**2 + (high_bend - low_bend) / w
    pull = axes.kappa * (w / (dl * du)) ** 2 * (1.0 + pulled)
    turned = s + 0.5 * (dl / du - du / dl)
    return L, (s, pulled, pull, turned, carried, steady, k1, k1_rate, w, closing, outside)


def _slopes(
    axes: Axes,
    s: FloatArray,
    pulled: FloatArray,
    pull: FloatArray,
    turned: FloatArray,
    carried: FloatArray,
    steady: FloatArray,
    k1: FloatArray,
    k1_rate: FloatArray,
    w: FloatArray,
    closing: FloatArray,
    outside: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return bounds of dL/dx and dL/dv between neighbouring positions, each of shape (k - 1, b)."""
    across = s[:-1] * s[1:] < 0.0
    least = np.where(across, 0.0, np.minimum(pulled[:-1], pulled[1:]))
    most = np.maximum(pulled[:-1], pulled[1:])
    least_pull = np.where(across, 16.0 * axes.kappa / w**2, np.minimum(pull[:-1], pull[1:]))
    most_pull = np.maximum(pull[:-1], pull[1:])
    products = np.stack([turned[i] * carried[j] for i in _NEAR for j in _NEAR])
    gain, turn = k1 * axes.k2 + k1_rate, 2.0 * k1 / w
    low = steady - gain * (1.0 - least) - most_pull - turn * products.max(axis=0)
    high = steady - gain * (1.0 - most) - least_pull - turn * products.min(axis=0)
    beyond = np.logical_or(outside[:-1], outside[1:])
    low, high = np.where(beyond, np.minimum(low, 0.0), low), np.where(beyond, np.maximum(high, 0.0), high)
    return low, high, closing - axes.k2 - k1 * (1.0 - least), closing - axes.k2 - k1 * (1.0 - most)


_NEAR = (slice(None, -1), slice(1, None))
"""Of neighbouring positions the first ones, and the second ones."""
