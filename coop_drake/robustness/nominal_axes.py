"""Where a nominal motion stays for ever once its funnel is closed.

About rest in the middle of the closed funnel the law is a line plus a rest that is bounded by W while the
axis departs by at most X and V. The departure is then the sum of what is left of the one at the time t0, and
of the responses to all rests since: |x| <= transient + W sum |h_x|, and so for v. The tube says how far the
axis departs from t0 until some time constants later, when the transient has vanished but for a small share.
If the sum is at most X and V from then on, it stays so at every later sample by induction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import (
    GOAL_LOWER,
    GOAL_UPPER,
    POSITION_GAIN,
    RAMP_RATE,
    RATE_GAIN,
    SATURATION,
    bounds_of,
    slope_bounds,
)
from coop_drake.laws.nominal import lag_factors
from coop_drake.laws.ppc import ramped_gain
from coop_drake.planning.budget.axis_tube import AxisConditions
from coop_drake.planning.budget.law_fit import fit_law, law_memory
from coop_drake.tree.pose import FloatArray

TIME_CONSTANTS = 5.0
"""Length of the responses over their slowest time constant [-]: less than a hundredth of them is left, and
is counted."""

ATTEMPTS = 40
"""Largest number of larger and larger departures that are tried [-]."""

LONG_AFTER = 100.0
"""Time at which gains are ramped in and funnels closed [s]."""

GROWTH = 1.01
"""Factor by which departures are enlarged for the next attempt [-]."""

SPARE = 1.002
"""Departures must be so many times those that follow from them [-]: what a plan states is rounded up."""


class Settled(NamedTuple):
    """Bounds from some time on; infinite, with a negative distance, if none can be shown.

    Attributes:
        distance: Least distance to the funnel's bounds [rad or m].
        acceleration: Largest |x''| [rad/s^2 or m/s^2].
        x: Largest departure from the middle [rad or m].
        rate: Largest rate [rad/s or m/s].
    """

    distance: float
    acceleration: float
    x: float
    rate: float


@compiled
def settle(
    row: FloatArray,
    conditions: AxisConditions,
    time: float,
    entry: tuple[float, float, float],
    followed: tuple[float, float],
    samples: int,
) -> Settled:
    """Bound an axis near the middle of its closed funnel for all later times.

    The gain k1 may still grow a little: that is counted as a disturbance.

    Args:
        row: The axis, a row of an ``axis_table``.
        conditions: How its motion is computed.
        time: t0, not before the funnel is closed [s].
        entry: The most that x, v and x'' may depart from the middle, from rest and from zero at t0.
        followed: The most that x and v may depart from t0 until the end of the tube.
        samples: Number of samples from t0 to the end of the tube, see ``tail_samples``.
    """
    lower, upper = bounds_of(row, time)[:2]
    half, T = 0.5 * (upper - lower), conditions.period
    x, v = followed
    for _ in range(ATTEMPTS):
        if not x < half:
            break
        slope, by_rate, size, most = _line(row, time, x, v)
        fastest = max(most, entry[2])
        sums = _sums(conditions, slope, by_rate, entry, samples)
        x_next, v_next = sums[0, 0] + sums[1, 0] * size, sums[0, 1] + sums[1, 1] * size
        if SPARE * x_next <= x and SPARE * v_next <= v:
            return Settled(half - x - 0.125 * T * T * fastest, fastest, x, v)
        x, v = max(x, GROWTH * x_next), max(v, GROWTH * v_next)
    return Settled(-1.0, np.inf, np.inf, np.inf)


@compiled(borrows=True)
def tail_samples(row: FloatArray, conditions: AxisConditions) -> int:
    """Return for how many samples an axis is followed after its funnel is closed, ``TIME_CONSTANTS`` long."""
    middle = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    slopes = slope_bounds(row, LONG_AFTER, middle, 0.0, 0.0)
    stiffness, damping = -slopes[0], -slopes[2]
    slowest = min(stiffness / damping, 0.5 * damping)
    return int(np.ceil(TIME_CONSTANTS / (slowest * conditions.period))) + 2


@compiled
def _line(row: FloatArray, time: float, x: float, v: float) -> tuple[float, float, float, float]:
    """Return the law's slopes, the size of its rest and the largest |x''|, for departures up to x and v."""
    k1, k1_dot = ramped_gain(time, row[POSITION_GAIN], row[RAMP_RATE])
    lower, upper = bounds_of(row, time)[:2]
    missing = row[POSITION_GAIN] - k1
    slope, by_rate, rest, spread = fit_law(row, time, 0.5 * (lower + upper), x, 0.0, law_memory())
    growing = (row[RATE_GAIN] * missing + k1_dot) * x
    growing += missing * (1.0 - np.log(row[SATURATION])) * v  # |h| <= 1 + |s| <= 1 - ln(saturation)
    rest += spread * v + growing
    return slope, by_rate, rest, abs(slope) * x + abs(by_rate) * v + rest


@compiled
def _sums(
    conditions: AxisConditions,
    slope: float,
    by_rate: float,
    entry: tuple[float, float, float],
    samples: int,
) -> FloatArray:
    """Return what is left of x and v at most, and the sums over all samples of |h_x| and |h_v|, shape (2, 2).

    What is left of the responses after the followed samples is a departure again, of which the responses
    follow: with q the largest share of a sum that it causes, the sum is at most its first part over 1 - q.
    What is left of the departure at the beginning is at most a share of what there was, and so are all
    departures that follow from it.

    Args:
        conditions: How the motion is computed.
        slope: Slope of the law by position [1/s^2].
        by_rate: Slope of the law by rate [1/s].
        entry: Departures of x, v and p at the beginning.
        samples: For how many samples responses are followed.
    """
    T, result = conditions.period, np.full((2, 2), np.inf)
    left, in_v, in_x = lag_factors(T, conditions.lag)
    x, v, p = np.zeros(4), np.zeros(4), np.zeros(4)
    x[0], v[1], p[2] = 1.0, 1.0, 1.0
    sums, reached = np.zeros((2, 4)), np.array([entry[0], entry[1]])
    for k in range(samples):
        x_now = v_now = 0.0
        for j in range(4):
            u = slope * x[j] + by_rate * v[j] + (1.0 if j == 3 and k == 0 else 0.0)
            gap = p[j] - u
            x[j] += T * v[j] + 0.5 * T * T * u + in_x * gap
            v[j] += T * u + in_v * gap
            p[j] = u + left * gap
            sums[0, j] += abs(x[j])
            sums[1, j] += abs(v[j])
            if j < 3:
                x_now += abs(x[j]) * entry[j]
                v_now += abs(v[j]) * entry[j]
        reached[0], reached[1] = max(reached[0], x_now), max(reached[1], v_now)
    share = kept = 0.0
    for j in range(4):
        ends = abs(x[j]), abs(v[j]), abs(p[j])
        x_again = v_again = 0.0
        for i in range(3):
            x_again += ends[i] * sums[0, i]
            v_again += ends[i] * sums[1, i]
        share = max(share, x_again / sums[0, j], v_again / sums[1, j]) if sums[0, j] > 0.0 else share
    for i, end in enumerate((x, v, p)):
        again = abs(end[0]) * entry[0] + abs(end[1]) * entry[1] + abs(end[2]) * entry[2]
        kept = max(kept, again / entry[i]) if again > 0.0 else kept
    if share < 0.5 and kept < 0.5:
        for i in range(2):
            result[0, i], result[1, i] = kept * reached[i], sums[i, 3] / (1.0 - share)
    return result
