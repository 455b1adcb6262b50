"""Where an axis stays for ever once its funnel is closed, under a budget of departures.

About rest in the middle of the closed funnel the law is a line plus a rest that is bounded while the axis
departs by at most X and V. The departure is then the sum of what is left of the one at the time t0, and of
the responses to all disturbances since, each at most W: |x| <= transient + W sum |h_x|, and so for v. The
tube says how far the axis departs from t0 until some time constants later, when the transient has vanished
but for a small share. If the sum is at most X and V from then on, it stays so at every later sample by
induction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import (
    GOAL_LOWER,
    GOAL_UPPER,
    LOG_GAIN,
    POSITION_GAIN,
    RAMP_RATE,
    RATE_GAIN,
    SATURATION,
    bounds_of,
)
from coop_drake.laws.nominal_axes import lag_factors
from coop_drake.laws.ppc import ramped_gain
from coop_drake.planning.budget.axis_tube import AxisConditions
from coop_drake.planning.budget.law_fit import fit_law, law_memory
from coop_drake.tree.pose import FloatArray

TIME_CONSTANTS = 5.0
"""Length of the responses over their slowest time constant [-]: less than a hundredth of them is left, and
is counted."""

ATTEMPTS = 40
"""Largest number of larger and larger departures that are tried [-]."""

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
        conditions: What disturbs it.
        time: t0, not before the funnel is closed [s].
        entry: The most that x, v and x'' may depart from the middle, from rest and from zero at t0, and
            before t0 as far back as the oldest measurement that is used after it.
        followed: The most that x and v may depart from t0 until the end of the tube.
        samples: Number of samples from t0 to the end of the tube, see ``tail_samples``.
    """
    lower, upper = bounds_of(row, time)[:2]
    half, T = 0.5 * (upper - lower), conditions.period
    x, v, first, fastest = followed[0], followed[1], 0.0, 0.0
    for _ in range(ATTEMPTS):
        if not x + conditions.position_noise < half:
            break
        slope, by_rate, size, most = _line(row, conditions, time, x, v)
        first, fastest = max(first, most), max(most, entry[2])
        sums = _sums(conditions, slope, by_rate, entry, first, samples)
        x_next, v_next = sums[0, 0] + sums[1, 0] * size, sums[0, 1] + sums[1, 1] * size
        if SPARE * x_next <= x and SPARE * v_next <= v:
            return Settled(half - x - 0.125 * T * T * fastest, fastest, x, v)
        x, v = max(x, GROWTH * x_next), max(v, GROWTH * v_next)
    return Settled(-1.0, np.inf, np.inf, np.inf)


@compiled
def tail_samples(row: FloatArray, conditions: AxisConditions) -> int:
    """Return for how many samples an axis is followed after its funnel is closed, ``TIME_CONSTANTS`` long."""
    width, k1, k2 = row[GOAL_UPPER] - row[GOAL_LOWER], row[POSITION_GAIN], row[RATE_GAIN]
    stiffness, damping = k1 * k2 + 16.0 * row[LOG_GAIN] / (width * width), k1 + k2
    slowest = min(stiffness / damping, 0.5 * damping)
    return int(np.ceil(TIME_CONSTANTS / (slowest * conditions.period))) + 2 * conditions.delay + 2


@compiled
def _line(
    row: FloatArray, conditions: AxisConditions, time: float, x: float, v: float
) -> tuple[float, float, float, float]:
    """Return the law's slopes, the size of a command's disturbance and the largest |x''|, for |x|, |v|."""
    reach, fast, factor = x + conditions.position_noise, v + conditions.rate_noise, conditions.model_factor
    k1, k1_dot = ramped_gain(time, row[POSITION_GAIN], row[RAMP_RATE])
    lower, upper = bounds_of(row, time)[:2]
    missing = row[POSITION_GAIN] - k1
    slope, by_rate, rest, spread = fit_law(row, time, 0.5 * (lower + upper), reach, 0.0, law_memory())
    growing = (row[RATE_GAIN] * missing + k1_dot) * reach
    growing += missing * (1.0 - np.log(row[SATURATION])) * fast  # |h| <= 1 + |s| <= 1 - ln(saturation)
    slope, by_rate, rest = factor * slope, factor * by_rate, factor * (rest + spread * fast + growing)
    most = abs(slope) * reach + abs(by_rate) * fast + rest
    error = conditions.model_error / factor * most + conditions.acceleration_error
    size = abs(slope) * conditions.position_noise + abs(by_rate) * conditions.rate_noise + rest + error
    return slope, by_rate, size, most + error


@compiled
def _sums(
    conditions: AxisConditions,
    slope: float,
    by_rate: float,
    entry: tuple[float, float, float],
    first: float,
    samples: int,
) -> FloatArray:
    """Return what is left of x and v at most, and the sums over all samples of |h_x| and |h_v|, shape (2, 2).

    What is left of the responses after the followed samples is a departure again, of which the responses
    follow: with q the largest share of a sum that it causes, the sum is at most its first part over 1 - q.
    What is left of the departure at the beginning is at most a share of what there was, and so are all
    departures that follow from it.

    Args:
        conditions: What disturbs the axis.
        slope: Slope of the law by position [1/s^2].
        by_rate: Slope of the law by rate [1/s].
        entry: Departures of x, v and p at the beginning.
        first: The whole command as long as it rests on measurements from before [rad/s^2 or m/s^2].
        samples: For how many samples responses are followed.
    """
    T, delay, result = conditions.period, conditions.delay, np.full((2, 2), np.inf)
    left, in_v, in_x = lag_factors(T, conditions.lag)
    n = samples
    x, v, p = np.zeros((n + 1, 4)), np.zeros((n + 1, 4)), np.zeros(4)
    x[0, 0], v[0, 1], p[2] = 1.0, 1.0, 1.0
    sums, ends, reached = np.zeros((2, 4)), np.zeros((4, 4)), np.array([entry[0], entry[1]])
    for k in range(n):
        x_now = v_now = 0.0
        for j in range(4):
            u = slope * x[k - delay, j] + by_rate * v[k - delay, j] if k >= delay else 0.0
            u += 1.0 if j == 3 and k == 0 else 0.0
            gap = p[j] - u
            x[k + 1, j] = x[k, j] + T * v[k, j] + 0.5 * T * T * u + in_x * gap
            v[k + 1, j] = v[k, j] + T * u + in_v * gap
            p[j] = u + left * gap
            sums[0, j] += abs(x[k + 1, j])
            sums[1, j] += abs(v[k + 1, j])
            if k + 1 >= n - delay:
                ends[0, j] = max(ends[0, j], abs(x[k + 1, j]))
                ends[1, j] = max(ends[1, j], abs(v[k + 1, j]))
                ends[2, j] = max(ends[2, j], abs(p[j]))
            if j < 3:
                x_now += abs(x[k + 1, j]) * entry[j]
                v_now += abs(v[k + 1, j]) * entry[j]
        for i in range(min(delay, k + 1)):  # the first commands, one for each period of delay
            x_now += first * abs(x[k + 1 - i, 3])
            v_now += first * abs(v[k + 1 - i, 3])
        reached[0], reached[1] = max(reached[0], x_now), max(reached[1], v_now)
    ends[3] = delay * (abs(slope) * ends[0] + abs(by_rate) * ends[1])
    share, kept, size = 0.0, 0.0, (entry[0], entry[1], entry[2], delay * first)
    for j in range(4):
        again = x_again = v_again = 0.0
        for i in range(4):
            again += ends[j, i] * size[i]
            x_again += ends[i, j] * sums[0, i]
            v_again += ends[i, j] * sums[1, i]
        kept = max(kept, again / size[j]) if again > 0.0 else kept
        if sums[0, j] > 0.0:
            share = max(share, x_again / sums[0, j], v_again / sums[1, j])
    if share < 0.5 and kept < 0.5:
        for i in range(2):
            result[0, i], result[1, i] = kept * reached[i], sums[i, 3] / (1.0 - share)
    return result
