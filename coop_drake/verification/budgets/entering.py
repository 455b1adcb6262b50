"""The states in which axes can enter the next cell."""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from coop_drake.answers.budget import Budget, Tolerance
from coop_drake.answers.plan import Transition
from coop_drake.laws.gains import RestCondition
from coop_drake.tree.pose import FloatArray, IntArray


def entering(
    transition: Transition,
    budget: Budget,
    made: FloatArray,
    samples: FloatArray,
    members: IntArray,
    last: FloatArray,
    rest: RestCondition,
    stated: Tolerance,
) -> FloatArray:
    """Return lower and upper position [rad or m] and rate, and the largest acceleration, shape (5, axes).

    Reports are made when a motion is at rest, not before the cell may be left.

    Args:
        transition: The transition that ends.
        budget: The budget.
        made: The tubes of all parts of its axes, as ``tubes`` returns them.
        samples: How many samples of each tube there are, shape (b,).
        members: Axis of each tube, shape (b,).
        last: Largest |acceleration| of each tube after its end, shape (b,) [rad/s^2 or m/s^2].
        rest: Under which condition the cell is left.
        stated: What the transition states.
    """
    T, middle = budget.period, 0.5 * (transition.goal_lower + transition.goal_upper)
    since = ceil(budget.report_age / T - 1e-9) + 1
    stay = ceil(max(transition.gains.hand_over_time, rest.after) / T - 1e-6)
    result = np.empty((5, middle.size))
    for axis in range(middle.size):
        limits = rest.reach[axis], rest.rate[axis]
        x, v, states = stated.settled[axis], stated.settled_rate[axis], []
        for i in np.flatnonzero(members == axis):
            tube = made[: samples[i], :, i].copy()
            tube[:, 0] -= middle[axis]
            states += _switched(tube, limits, since, stay, T)
            history = max(last[i], tube[len(tube) - 1 - since :, 4].max())
            states.append(_limited((-x, x, -v, v, last[i], history), limits, since * T))
        lows, highs, slow, quick, pushed, _ = np.array(states).T
        result[:, axis] = (
            middle[axis] + lows.min(),
            middle[axis] + highs.max(),
            slow.min(),
            quick.max(),
            pushed.max(),
        )
    return result


def first_rest(
    transition: Transition,
    period: float,
    made: FloatArray,
    samples: FloatArray,
    members: IntArray,
    rest: RestCondition,
) -> int:
    """Return the first sample at which all axes can be at rest and the cell be left; arguments as above."""
    middle = 0.5 * (transition.goal_lower + transition.goal_upper)
    first = ceil(max(transition.gains.hand_over_time, rest.after) / period - 1e-6)
    latest = first
    for axis in range(middle.size):
        limits, ends = (rest.reach[axis], rest.rate[axis]), []
        for i in np.flatnonzero(members == axis):
            tube = made[: samples[i], :, i].copy()
            tube[:, 0] -= middle[axis]
            times = np.flatnonzero(_resting(tube, limits))
            ends.append(next(iter(times[times >= first]), max(first, len(tube))))
        latest = max(latest, min(ends))
    return int(latest)


def _resting(tube: FloatArray, limits: tuple[float, float]) -> NDArray[np.bool_]:
    """Return at which samples a tube about the middle holds a motion at rest."""
    low, high = tube[:, [0, 2]] - tube[:, [1, 3]], tube[:, [0, 2]] + tube[:, [1, 3]]
    there: NDArray[np.bool_] = np.all((low <= limits) & (high >= -np.array(limits)), axis=1)
    return there


def _switched(
    tube: FloatArray, limits: tuple[float, float], since: int, stay: int, period: float
) -> list[tuple[float, ...]]:
    """Return in which states a tube about the middle can be when the cell is switched before its end."""
    low, high = tube[:, [0, 2]] - tube[:, [1, 3]], tube[:, [0, 2]] + tube[:, [1, 3]]
    times = np.flatnonzero(_resting(tube, limits))
    times = times[times >= stay]
    possible = [k for k in range(stay, len(tube)) if ((times <= k) & (times >= k - since)).any()]
    if not possible:
        return []
    history = max(tube[max(k - since, stay) : k + 1, 4].max() for k in possible)
    x, v = (low[possible].min(axis=0), high[possible].max(axis=0))
    state = x[0], v[0], x[1], v[1], tube[possible, 4].max(), history
    return [_limited(state, limits, since * period)]


def _limited(state: tuple[float, ...], limits: tuple[float, float], time: float) -> tuple[float, ...]:
    """Return the state cut to where a motion can have gone that was at rest this long ago."""
    x_low, x_high, v_low, v_high, pushed, history = state
    far, fast = limits[0] + time * (limits[1] + 0.5 * time * history), limits[1] + time * history
    return max(x_low, -far), min(x_high, far), max(v_low, -fast), min(v_high, fast), pushed, history
