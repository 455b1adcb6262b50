"""Funnels: bounds of an angle or a joint that shrink from a slice to its goal interval, (17) and (39)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.jit import compiled
from coop_drake.laws.gains import FunnelShape
from coop_drake.tree.pose import FloatArray

CLOSING = 5.0
"""lambda times the time T_f after which a quintic funnel is closed [-]: e^-5 is below a hundredth, so
that the exponential funnel of the same lambda is closed for all purposes then, too."""

STEEPEST = 1.875
"""Largest rate of the quintic over u [-], at u = 1 / 2."""


@dataclass(frozen=True)
class Funnel:
    """The funnels of one transition, one for each axis.

    Attributes:
        slice_lower: Lower bounds at time 0, shape (m,) [rad or m].
        slice_upper: Upper bounds at time 0, shape (m,) [rad or m].
        goal_lower: Lower bounds in the limit, shape (m,) [rad or m].
        goal_upper: Upper bounds in the limit, shape (m,) [rad or m].
        decay_rate: lambda, shape (m,) [1/s].
        shape: ``exponential``, e^(-lambda t) as printed, or ``quintic``, see ``decay_factor``.
    """

    slice_lower: FloatArray
    slice_upper: FloatArray
    goal_lower: FloatArray
    goal_upper: FloatArray
    decay_rate: FloatArray
    shape: FunnelShape = "quintic"

    def select(self, axes: NDArray[np.intp]) -> Funnel:
        """Return the funnels of some axes only, for instance those that one robot controls."""
        return replace(
            self,
            slice_lower=self.slice_lower[axes],
            slice_upper=self.slice_upper[axes],
            goal_lower=self.goal_lower[axes],
            goal_upper=self.goal_upper[axes],
            decay_rate=self.decay_rate[axes],
        )


class FunnelBounds(NamedTuple):
    """Bounds of m axes at one instant and their derivatives, each of shape (m,), in rad or m and seconds."""

    lower: FloatArray
    upper: FloatArray
    lower_rate: FloatArray
    upper_rate: FloatArray
    lower_acceleration: FloatArray
    upper_acceleration: FloatArray


@compiled
def decay_factor(time: float, decay_rate: float, quintic: bool) -> tuple[float, float, float]:
    """Return f(t) of a funnel, which decays from 1 to 0, with its first and second derivative.

    f(t) = e^(-lambda t) as printed; or where the funnel is quintic f = 1 - 10 u^3 + 15 u^4 - 6 u^5 with
    u = t / T_f, T_f = 5 / lambda, and 0 after T_f. Value, rate and acceleration of the quintic are continuous
    at 0 and at T_f: bounds that rest begin to move, and come to rest, without a step of the law.

    Args:
        time: t >= 0 since the transition began [s].
        decay_rate: lambda [1/s].
        quintic: Which of the two shapes.
    """
    if not quintic:
        exponential = np.exp(-decay_rate * time)
        return exponential, -decay_rate * exponential, decay_rate * decay_rate * exponential
    u, rate = decay_rate * time / CLOSING, decay_rate / CLOSING
    if u >= 1.0:
        return 0.0, 0.0, 0.0
    left = 1.0 - u
    return (
        left * left * left * (1.0 + 3.0 * u + 6.0 * u * u),
        -30.0 * rate * u * u * left * left,
        -60.0 * rate * rate * u * left * (1.0 - 2.0 * u),
    )


@compiled
def axis_bounds(
    time: float,
    slice_lower: float,
    slice_upper: float,
    goal_lower: float,
    goal_upper: float,
    decay_rate: float,
    quintic: bool,
) -> tuple[float, float, float, float, float, float]:
    """Return the bounds of one axis, (17) and (39) with errata E17a and E39, and their derivatives.

    rho(t) = rho_G + (rho_0 - rho_G) f(t), for the lower and for the upper bound, each from its own end of the
    slice.

    Args:
        time: t >= 0 since the transition began [s].
        slice_lower: rho_0 of the lower bound [rad or m].
        slice_upper: rho_0 of the upper bound [rad or m].
        goal_lower: rho_G of the lower bound [rad or m].
        goal_upper: rho_G of the upper bound [rad or m].
        decay_rate: lambda [1/s].
        quintic: Whether f is that of the quintic funnel, see ``decay_factor``.

    Returns:
        Lower and upper bound [rad or m], their rates [per s] and their accelerations [per s^2].
    """
    value, first, second = decay_factor(time, decay_rate, quintic)
    below, above = slice_lower - goal_lower, slice_upper - goal_upper
    return (
        goal_lower + below * value,
        goal_upper + above * value,
        below * first,
        above * first,
        below * second,
        above * second,
    )


def funnel_bounds(funnel: Funnel, time: float) -> FunnelBounds:
    """Return ``axis_bounds`` of every axis of a funnel, ``time`` [s] after the transition began."""
    intervals = (funnel.slice_lower, funnel.slice_upper, funnel.goal_lower, funnel.goal_upper)
    quintic = funnel.shape == "quintic"
    rows = [
        axis_bounds(float(time), slice_lower, slice_upper, goal_lower, goal_upper, rate, quintic)
        for slice_lower, slice_upper, goal_lower, goal_upper, rate in zip(
            *intervals, funnel.decay_rate, strict=True
        )
    ]
    return FunnelBounds(*np.array(rows).T)


def check_intervals(
    slice_lower: FloatArray, slice_upper: FloatArray, goal_lower: FloatArray, goal_upper: FloatArray
) -> None:
    """Refuse funnels without an interior; rounding of a bound that the two intervals share is tolerated.

    Args:
        slice_lower: Lower ends of the slice, shape (m,) [rad or m].
        slice_upper: Upper ends of the slice, shape (m,).
        goal_lower: Lower ends of the goal intervals, shape (m,).
        goal_upper: Upper ends of the goal intervals, shape (m,).

    Raises:
        ValueError: Names the axis.
    """
    rounding = 1e-9 * (1.0 + np.abs(slice_lower) + np.abs(slice_upper))
    good = (slice_lower < slice_upper) & (goal_lower < goal_upper)
    good &= (goal_lower >= slice_lower - rounding) & (goal_upper <= slice_upper + rounding)
    if not np.all(good):
        axis = int(np.argmin(good))
        raise ValueError(
            f"axis {axis}: goal interval [{goal_lower[axis]}, {goal_upper[axis]}] must be inside "
            f"slice [{slice_lower[axis]}, {slice_upper[axis]}], and both longer than a point"
        )
