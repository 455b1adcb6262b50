"""The set in which an axis stays for ever once its funnel is closed, under a budget of departures."""

from __future__ import annotations

import numpy as np

from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import POSITION_GAIN, RAMP_RATE, RATE_GAIN, SATURATION, bounds_of
from coop_drake.laws.ppc import ramped_gain
from coop_drake.planning.budget.axis_tube import AxisConditions, lag_factors
from coop_drake.planning.budget.law_fit import fit_law
from coop_drake.tree.pose import FloatArray

TIME_CONSTANTS = 12.0
"""Length of the responses over their slowest time constant [-]: e^-12 of them is left, and what is left is
counted, because the set is shown to be reached again."""

ATTEMPTS = 60
"""Largest number of larger and larger sets that are tried [-]."""

GROWTH = 1.03
"""Factor by which a set is enlarged for the next attempt [-]."""

NOWHERE = (np.inf, np.inf, np.inf, np.inf, np.inf)


@compiled
def settle(
    row: FloatArray, conditions: AxisConditions, time: float, entry: tuple[float, float, float]
) -> tuple[float, float, float, float, float]:
    """Bound an axis near the middle of its closed funnel for all later times.

    A box of departures (x, v, p) is sought that holds the axis again after some samples, also for the samples
    that measurements still speak of then. What holds until then holds for ever, by induction. The gain k1
    may still grow a little: that is counted as a disturbance.

    Args:
        row: The axis, a row of an ``axis_table``.
        conditions: What disturbs it.
        time: From when on, not before the funnel is closed [s].
        entry: The most that x, v and x'' may depart from the middle, from rest and from zero, then and in the
            time before which measurements then speak of.

    Returns:
        Least distance to the funnel's bounds (negative if none can be shown), largest |x''|, largest
        departure of x and of v at all times, and that of x at the end; infinite if there is no such box.
    """
    lower, upper = bounds_of(row, time)[:2]
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
    k1, k1_dot = ramped_gain(time, row[POSITION_GAIN], row[RAMP_RATE])
    missing, T = row[POSITION_GAIN] - k1, conditions.period
    box = np.array(entry)
    x_most, v_most = GROWTH * box[0], GROWTH * box[1]
    for _ in range(ATTEMPTS):
        reach, fast = x_most + conditions.position_noise, v_most + conditions.rate_noise
        if not reach < half:
            break
        slope, by_rate, rest, spread = fit_law(row, time, middle, reach, 0.0)
        growing = (row[RATE_GAIN] * missing + k1_dot) * reach
        growing += missing * (1.0 - np.log(row[SATURATION])) * fast  # |h| <= 1 + |s| <= 1 - ln(saturation)
        factor = conditions.model_factor
        slope, by_rate, rest = factor * slope, factor * by_rate, factor * (rest + spread * fast + growing)
        most = abs(slope) * reach + abs(by_rate) * fast + rest
        error = conditions.model_error / factor * most + conditions.acceleration_error
        size = abs(slope) * conditions.position_noise + abs(by_rate) * conditions.rate_noise + rest + error
        reached = _reached(conditions, slope, by_rate, box, size, most + error)
        x_all, v_all, x_end, v_end, p_end = reached
        if not x_all < np.inf:
            break
        if x_all <= x_most and v_all <= v_most and x_end <= box[0] and v_end <= box[1] and p_end <= box[2]:
            fastest = max(most + error, box[2])
            distance = half - x_most - 0.125 * T * T * fastest
            return distance, fastest, x_most, v_most, x_end
        for i in range(3):
            box[i] = max(box[i], GROWTH * reached[2 + i]) if reached[2 + i] > box[i] else box[i]
        x_most, v_most = max(x_most, GROWTH * x_all), max(v_most, GROWTH * v_all)
    return -1.0, np.inf, np.inf, np.inf, np.inf


@compiled
def _reached(
    conditions: AxisConditions, slope: float, by_rate: float, box: FloatArray, size: float, first: float
) -> tuple[float, float, float, float, float]:
    """Return the largest departures of x and v at all samples, and of x, v and p at the last ones.

    Args:
        conditions: What disturbs the axis.
        slope: Slope of the law by position [1/s^2].
        by_rate: Slope of the law by rate [1/s].
        box: Departures of x, v and p at the beginning.
        size: Disturbance of every command [rad/s^2 or m/s^2].
        first: The whole command as long as it rests on measurements from before [rad/s^2 or m/s^2].
    """
    T, delay = conditions.period, conditions.delay
    left, in_v, in_x = lag_factors(T, conditions.lag)
    slowest = min(abs(slope) / max(abs(by_rate), 1e-9), 0.5 * abs(by_rate))
    if not (slope < 0.0 and by_rate < 0.0 and slowest * T * 1e5 > TIME_CONSTANTS):
        return np.inf, np.inf, np.inf, np.inf, np.inf
    n = int(np.ceil(TIME_CONSTANTS / (slowest * T))) + 2 * delay + 2
    x, v, p = np.zeros((n + 1, 4)), np.zeros((n + 1, 4)), np.zeros(4)
    x[0, 0], v[0, 1], p[2] = 1.0, 1.0, 1.0
    x_sum, v_sum, p_sum = np.zeros(n + 1), np.zeros(n + 1), np.zeros(n + 1)
    x_all, v_all, ends = box[0], box[1], np.zeros(3)
    for k in range(n):
        for j in range(4):
            u = slope * x[k - delay, j] + by_rate * v[k - delay, j] if k >= delay else 0.0
            u += 1.0 if j == 3 and k == 0 else 0.0
            gap = p[j] - u
            x[k + 1, j] = x[k, j] + T * v[k, j] + 0.5 * T * T * u + in_x * gap
            v[k + 1, j] = v[k, j] + T * u + in_v * gap
            p[j] = u + left * gap
        x_sum[k + 1] = x_sum[k] + abs(x[k + 1, 3])
        v_sum[k + 1] = v_sum[k] + abs(v[k + 1, 3])
        p_sum[k + 1] = p_sum[k] + abs(p[3])
        since = max(k + 1 - delay, 0)  # the first commands, one for each period of delay
        x_now = size * x_sum[k + 1] + (first - size) * (x_sum[k + 1] - x_sum[since])
        v_now = size * v_sum[k + 1] + (first - size) * (v_sum[k + 1] - v_sum[since])
        p_now = size * p_sum[k + 1] + (first - size) * (p_sum[k + 1] - p_sum[since])
        for j in range(3):
            x_now += abs(x[k + 1, j]) * box[j]
            v_now += abs(v[k + 1, j]) * box[j]
            p_now += abs(p[j]) * box[j]
        x_all, v_all = max(x_all, x_now), max(v_all, v_now)
        if k + 1 >= n - delay:
            ends[0], ends[1], ends[2] = max(ends[0], x_now), max(ends[1], v_now), max(ends[2], p_now)
        if not x_all < 1e3:
            return np.inf, np.inf, np.inf, np.inf, np.inf
    return x_all, v_all, ends[0], ends[1], ends[2]
