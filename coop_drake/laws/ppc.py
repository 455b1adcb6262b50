"""Prescribed performance control, (17)-(20) and (35)-(39): funnels, clock, limits, hand-overs, law."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, inf, log
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray

# Funnels: bounds of an angle or a joint that shrink from a slice to its goal interval, (17) and (39).

FunnelShape = Literal["exponential", "quintic"]

CLOSING = 5.0
"""lambda times the time T_f after which a quintic funnel is closed [-]: e^-5 is below a hundredth, so
that the exponential funnel of the same lambda is closed for all purposes then, too."""

STEEPEST = 1.875
"""Largest rate of the quintic over u [-], at u = 1 / 2."""

PEAK_RATE = STEEPEST / CLOSING
"""Largest rate of a quintic bound over lambda times the distance that it moves [-]."""


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


# How the funnels' clock slows down, stands still and runs again, so that a team rests inside its cell.
#
# While a team is held, h = 1, else h = 0. The clock's pace 1 - b follows h through two lags of first order
# with the same rate omega,
#
# a' = omega (h - a), b' = omega (a - b),
#
# which keep a and b in [0, 1] whenever h changes. Pace and its derivative are therefore continuous, and so
# are the bounds, their rates and their accelerations: with tau' = 1 - b the bound rho(tau(t)) has the rate
# rho' tau' and the acceleration rho'' tau'^2 + rho' tau''. The energy argument of ``track_axis`` holds for
# any bounds. The rate of p_G is multiplied by the pace; where Delta E is zero it is zero with any pace, so
# that Delta E does not become negative.

HOLD_RATE = 10.0
"""omega [1/s]: after a hold begins the clock loses its pace gradually, and advances by 2 / omega = 0.2 s in
all. A quicker one would ask for larger accelerations of the bounds than the funnels themselves."""

SETTLING_TIME = 1.0
"""So long after a hold the clock's pace is 1 for all purposes [s]: at 10 / omega, b is below a thousandth."""


def lagging_clock(time: float, held: float, start: FloatArray) -> tuple[float, float, float, float]:
    """Return a, b, b' and the time that the clock loses, in closed form while h is constant.

    Args:
        time: Time since h changed last [s].
        held: h, 1 where the team is held and 0 where it is not [-].
        start: a, b and the time lost so far, when h changed, shape (3,).

    Returns:
        a [-], b [-], b' [1/s] and the time lost [s].
    """
    left = exp(-HOLD_RATE * time)
    first, second = start[0] - held, start[1] - held
    a = held + first * left
    b = held + (second + HOLD_RATE * time * first) * left
    gone = (1.0 - left) / HOLD_RATE
    lost = held * time + second * gone + first * (gone - time * left)
    return a, b, HOLD_RATE * (a - b), start[2] + lost


# Hand-overs without steps: accelerations and gains go smoothly from the last cell's to the next one's.
#
# At a switch the law of the next cell asks for other accelerations than the law of the last one does. An
# axis adds the difference, found at the switch, to its new law, and lets it fade; the governor's gains move
# from the old values to the new ones. Fading takes the time T of the next transition. A robot is ready to
# leave a cell only after T, so that the law is pure again at the next switch.

STIFFNESS, DAMPING, GOVERNOR_GAIN, SMOOTHING = range(4)
"""Columns of a governor's row: the gains of the cell, c [m] ..."""

FIRST_STIFFNESS, FIRST_DAMPING, FIRST_GOVERNOR_GAIN, HAND_OVER_TIME = range(4, 8)
"""... and the gains of the cell before it, from which they start, and T [s] ..."""

SPEED_LIMIT = 8
"""... and the largest speed of the object, infinity for none [m/s]."""


@compiled
def fading(time: float, duration: float) -> float:
    """Return the factor that falls from 1 to 0 within T, as a quintic funnel closes; 0 where T is 0 [-].

    Args:
        time: Time since the cell was entered [s].
        duration: T [s].
    """
    return decay_factor(time, CLOSING / duration, True)[0] if time < duration else 0.0


@compiled(borrows=True)
def governed_gains(row: FloatArray, time: float) -> tuple[float, float, float]:
    """Return K, zeta and K_G now: K = K_1 (K_0 / K_1)^f with f of ``fading``, and so for the others.

    With e = p - p_G and Delta E of (15), for d > 0,

        Delta E' = (K' / K) Delta E + (zeta + K' / (2 K)) |p'|^2 + K (d d' + e . p_G').

    Where Delta E is zero p_G stands still, and Delta E cannot fall below zero while zeta >= -K' / (2 K): K
    may rise at any rate, and fall as slowly as ``shortest_hand_over`` sees to.

    Args:
        row: A governor's row, shape (9,).
        time: Time since the cell was entered [s].

    Returns:
        K [1/s^2], zeta [1/s] and K_G [-].
    """
    left = fading(time, row[HAND_OVER_TIME])
    if left == 0.0:
        return row[STIFFNESS], row[DAMPING], row[GOVERNOR_GAIN]
    return (
        row[STIFFNESS] * (row[FIRST_STIFFNESS] / row[STIFFNESS]) ** left,
        row[DAMPING] * (row[FIRST_DAMPING] / row[DAMPING]) ** left,
        row[GOVERNOR_GAIN] * (row[FIRST_GOVERNOR_GAIN] / row[GOVERNOR_GAIN]) ** left,
    )


def shortest_hand_over(largest_stiffness: float, smallest_stiffness: float, smallest_damping: float) -> float:
    """Return the shortest T in which K may fall [s]: -K' / (2 K) <= 1.875 ln(K_0 / K_1) / (2 T) <= zeta.

    Args:
        largest_stiffness: K_0 [1/s^2].
        smallest_stiffness: K_1 [1/s^2].
        smallest_damping: Smallest zeta on the way [1/s].
    """
    return 0.5 * STEEPEST * log(largest_stiffness / smallest_stiffness) / smallest_damping


# Speed limits of the object and of the axes, kept by extra damping near a limit.
#
# With the acceleration a that the other laws ask for, and the velocity v, the damping sigma >= 0 is the
# least for which
#
# (a - sigma v) . v <= g (L^2 - |v|^2) / 2.
#
# Then h = (L^2 - |v|^2) / 2 obeys h' >= -g h: a speed that begins below its limit L stays below it. At half
# the limit and less, the law leaves room for accelerations of g L and more.
#
# Extra damping takes energy from the object: E of (16) falls by sigma |p'|^2 besides, and Delta E of (15)
# stays positive as it does without a limit. An axis in its funnel gets -sigma x' (x' - v) besides in V' of
# ``track_axis``, which is not positive where x' has the direction of v and is at least as large. While x'
# is smaller, the law without a limit asks for k2 (v - x') + v' - kappa a s, and no damping is needed as
# long as g >= k2 and v' - kappa a s <= g (L - v): V decays as it does without a limit where the funnel is
# slow against L. ``FUNNEL_SHARE`` sees to that.

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


def funnel_rate(decay_rate: FloatArray, shrink: FloatArray, quintic: bool) -> FloatArray:
    """Return the largest rates of the bounds of some funnels, shape (m,) [rad/s or m/s].

    Args:
        decay_rate: lambda, shape (m,) [1/s].
        shrink: Distance that the bound moves, shape (m,) [rad or m].
        quintic: Whether the funnels are quintic.
    """
    return decay_rate * shrink * (PEAK_RATE if quintic else 1.0)


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
    return min(decay_rate, FUNNEL_SHARE * limit / (shrink * (PEAK_RATE if quintic else 1.0)))


# Prescribed performance control of the object's angle and of every joint, (18)-(20) and (35)-(38).

SATURATION = 1e-7
"""Smallest distance to a funnel bound that the law as printed computes with, over the funnel's width [-].
Trial steps of an integrator may end nearer or outside: the law must then point back inside and must not grow
with the distance, or the next trial step would overflow."""


@compiled
def ramped_gain(time: float, gain: float, ramp_rate: float) -> tuple[float, float]:
    """Return k1(t) = k1 (1 - (1 + mu t) e^(-mu t)) and its derivative [1/s, 1/s^2].

    Both begin at zero, so that an axis that enters a cell at rest is not thrown towards the funnel's middle.

    Args:
        time: t >= 0 since the cell was entered [s].
        gain: k1, the value in the limit [1/s].
        ramp_rate: mu [1/s]; for 0 the gain is k1 from the beginning.
    """
    if ramp_rate == 0.0:
        return gain, 0.0
    left = np.exp(-ramp_rate * time)
    return gain * (1.0 - (1.0 + ramp_rate * time) * left), gain * ramp_rate * ramp_rate * time * left


@compiled(borrows=True)
def track_axis(
    position: float,
    rate: float,
    bounds: tuple[float, float, float, float, float, float],
    gains: tuple[float, float, float, float, float],
) -> tuple[float, float]:
    """Return the acceleration x'' that keeps one axis in its funnel, and its energy V.

    With dl = x - rho_l, du = rho_u - x, w = dl + du, s = ln(dl / du) and a = w / (dl du), the back-stepping
    law of (18)-(20) and (35)-(38), errata E18, E20 and E35, is

        v   = (rho_l' du + rho_u' dl - k1 s dl du) / w
        x'' = -k2 (x' - v) + v' - kappa a s

    and the energy V = kappa s^2 / 2 + (x' - v)^2 / 2 of (41) and (48) decays with
    V' = -kappa k1 s^2 - k2 (x' - v)^2, also while k1 changes, because v' holds its rate k1'. The distances dl
    and du saturate: an axis that is nearer to a bound than a share of the width, or outside, counts as this
    far inside. Where they do, V is no longer sure to decay, and the law stays bounded.

    Args:
        position: x [rad or m].
        rate: x' [rad/s or m/s].
        bounds: rho_l, rho_u, their rates and their accelerations, as ``axis_bounds`` returns them.
        gains: kappa [rad^2/s^2 or m^2/s^2], k1 now [1/s], k1' now [1/s^2], k2 [1/s], and the smallest
            distance to a bound over the funnel's width [-].

    Returns:
        x'' [rad/s^2 or m/s^2] and V [rad^2/s^2 or m^2/s^2].
    """
    lower, upper, lower_rate, upper_rate, lower_acceleration, upper_acceleration = bounds
    log_gain, k1, k1_dot, k2, saturation = gains
    w, w_dot = upper - lower, upper_rate - lower_rate
    near, far = saturation * w, (1.0 - saturation) * w
    dl, du = min(max(position - lower, near), far), min(max(upper - position, near), far)
    s = np.log(dl / du)
    dl_dot, du_dot = rate - lower_rate, upper_rate - rate
    s_dot = dl_dot / dl - du_dot / du
    a = w / (dl * du)
    v = (lower_rate * du + upper_rate * dl - k1 * s * dl * du) / w
    v_dot = (
        lower_acceleration * du
        + lower_rate * du_dot
        + upper_acceleration * dl
        + upper_rate * dl_dot
        - k1 * (s_dot * dl * du + s * (dl_dot * du + dl * du_dot))
        - k1_dot * s * dl * du
        - v * w_dot
    ) / w
    acceleration = -k2 * (rate - v) + v_dot - log_gain * a * s
    return acceleration, 0.5 * log_gain * s * s + 0.5 * (rate - v) * (rate - v)
