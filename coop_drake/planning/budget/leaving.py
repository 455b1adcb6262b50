"""When an axis may leave its cell, and the set of states in which it can enter the next one."""

from __future__ import annotations

from math import ceil

import numpy as np

from coop_drake.laws.axis_table import (
    GOAL_LOWER,
    GOAL_UPPER,
    LEAVING_TIME,
    REST_RATE,
    REST_REACH,
)
from coop_drake.planning.budget.axis_sets import AxisSets, Entry
from coop_drake.planning.budget.axis_tube import ACCELERATION, V_REACH, X_REACH, AxisConditions, V, X
from coop_drake.tree.pose import FloatArray

SETTLED_FACTOR = 1.5
"""An axis counts as settled while it departs from rest by so many times what it does in the end [-]."""


def rest_needed(sets: AxisSets, conditions: AxisConditions) -> tuple[float, float]:
    """Return distance and rate within which a settled axis is measured [rad or m, rad/s or m/s]."""
    return sets.settled + conditions.position_noise, sets.settled_rate + conditions.rate_noise


def next_entry(
    row: FloatArray,
    sets: AxisSets,
    entry: Entry,
    conditions: AxisConditions,
    report_periods: int,
) -> Entry:
    """Return the set in which an axis can enter the next cell.

    It was measured at rest; since then the measurement's delay has passed, the time for which a report may be
    used, and a period. In that time it went no farther than its largest acceleration allows, and it has
    stayed in its tube.

    Args:
        row: The axis in this cell, with the condition of rest under which the cell is left.
        sets: Its sets.
        entry: The set in which it entered this cell.
        conditions: What disturbs it.
        report_periods: How long a report may be used, in periods.
    """
    middle = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    reach, fast = row[REST_REACH] + conditions.position_noise, row[REST_RATE] + conditions.rate_noise
    since = conditions.delay + report_periods + 1
    time = since * conditions.period

    def limited(
        x_low: float, x_high: float, v_low: float, v_high: float, pushed: float, history: float
    ) -> tuple[float, ...]:
        farther, faster = reach + time * (fast + 0.5 * time * history), fast + time * history
        return (
            max(x_low, middle - farther), min(x_high, middle + farther), max(v_low, -faster),
            min(v_high, faster), pushed, history,
        )  # fmt: skip

    x, v, pushed = sets.settled, sets.settled_rate, sets.last
    before = max(pushed, *(float(tube[-1 - since :, ACCELERATION].max()) for tube in sets.tubes))
    parts = [limited(middle - x, middle + x, -v, v, pushed, before)]
    for tube in sets.tubes:
        found = _switching(tube, middle, reach, fast, since, float(row[LEAVING_TIME]), conditions, entry)
        parts += [limited(*found)] if found else []
    lows, highs, slow, quick, pushes, histories = np.array(parts).T
    return Entry(
        float(lows.min()), float(highs.max()), float(slow.min()), float(quick.max()), float(pushes.max()),
        float(histories.max()), middle,
    )  # fmt: skip


def settling_time(row: FloatArray, sets: AxisSets, conditions: AxisConditions) -> float:
    """Return the time since the entry after which an axis departs from rest no more than when settled [s].

    It may depart by ``SETTLED_FACTOR`` times what it does in the end.
    """
    middle, samples = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER]), 0
    for tube in sets.tubes:
        far = np.abs(tube[:, X] - middle) + tube[:, X_REACH] > SETTLED_FACTOR * sets.settled
        fast = np.abs(tube[:, V]) + tube[:, V_REACH] > SETTLED_FACTOR * sets.settled_rate
        moving = np.flatnonzero(far | fast)
        samples = max(samples, int(moving[-1]) + 1) if moving.size else samples
    return samples * conditions.period


def _switching(
    tube: FloatArray,
    middle: float,
    reach: float,
    fast: float,
    since: int,
    leaving: float,
    conditions: AxisConditions,
    entry: Entry,
) -> tuple[float, ...]:
    """Return bounds of x and v, the largest |x''|, and that of the time before, when a tube can be left.

    Nothing if it cannot be left before its end.
    """
    x_low, x_high = tube[:, X] - tube[:, X_REACH], tube[:, X] + tube[:, X_REACH]
    v_low, v_high = tube[:, V] - tube[:, V_REACH], tube[:, V] + tube[:, V_REACH]
    reported = (x_low <= middle + reach) & (x_high >= middle - reach) & (v_low <= fast) & (v_high >= -fast)
    reported[0] = True  # reports may rest on measurements from before the entry
    possible = np.convolve(reported, np.ones(since + 1))[: len(tube)] > 0.5
    possible[: ceil(leaving / conditions.period - 1e-6)] = False
    if not possible.any():
        return ()
    pushed = tube[:, ACCELERATION]
    ahead = np.concatenate([np.full(since, max(entry.history, entry.acceleration)), pushed])
    history = np.lib.stride_tricks.sliding_window_view(ahead, since + 1).max(axis=1)
    return (
        float(x_low[possible].min()), float(x_high[possible].max()), float(v_low[possible].min()),
        float(v_high[possible].max()), float(pushed[possible].max()), float(history[possible].max()),
    )  # fmt: skip
