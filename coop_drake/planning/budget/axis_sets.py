"""The sets of one axis in one transition, and the set in which it can enter the next one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, exp, sqrt

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.laws.axis_table import (
    DECAY_RATE,
    ENERGY_BOUND,
    FADING_TIME,
    GOAL_LOWER,
    GOAL_UPPER,
    LOG_GAIN,
    RAMP_RATE,
    SLICE_LOWER,
    SLICE_UPPER,
)
from coop_drake.laws.funnels import CLOSING
from coop_drake.laws.readiness import EROSION
from coop_drake.planning.budget.axis_tube import (
    ACCELERATION,
    COLUMNS,
    DISTANCE,
    V_REACH,
    X_REACH,
    AxisConditions,
    V,
    X,
    follow_tube,
)
from coop_drake.planning.budget.settled import settle
from coop_drake.tree.pose import FloatArray

RAMPED = 7.0
"""mu t after which the gain k1 counts as ramped in [-]: less than a hundredth of it is missing then."""

LATE = 1
"""Periods for which the command of the cell before acts after a switch [-]: all robots compute at the instant
of the switch, before they hear of it."""


MODEL_PARTS = 3
"""Parts into which the range of the model's error is cut [-]: within each the factor by which accelerations
are too large is known but for a third of the error, which alone counts as a disturbance."""


@dataclass(frozen=True)
class Entry:
    """The set of states in which an axis enters a transition.

    Attributes:
        lower: Lowest position [rad or m].
        upper: Highest position [rad or m].
        rate_lower: Lowest rate [rad/s or m/s].
        rate_upper: Highest rate [rad/s or m/s].
        acceleration: Largest magnitude of acceleration and command at the entry [rad/s^2 or m/s^2].
        history: Largest magnitude of the acceleration before the entry, over the age of the measurements that
            are used at the entry [rad/s^2 or m/s^2].
    """

    lower: float
    upper: float
    rate_lower: float = 0.0
    rate_upper: float = 0.0
    acceleration: float = 0.0
    history: float = 0.0


@dataclass(frozen=True)
class AxisSets:
    """What follows for one axis in one transition.

    Attributes:
        tubes: Of every part of the entry set, shape (samples, ``COLUMNS``).
        distance: Least distance to the funnel's bounds at all times [rad or m]; not positive if none is
            shown.
        acceleration: Largest magnitude of the acceleration [rad/s^2 or m/s^2].
        x_most: Largest departure from the goal interval's middle after the tubes' end [rad or m].
        v_most: Largest rate after the tubes' end [rad/s or m/s].
        settled: Largest departure from the goal interval's middle at the end [rad or m].
        parts: Into how many parts the positions at the entry were cut.
    """

    tubes: tuple[FloatArray, ...]
    distance: float
    acceleration: float = np.inf
    x_most: float = np.inf
    v_most: float = np.inf
    settled: float = np.inf
    parts: int = 1


def conditions_of(budget: Budget) -> tuple[AxisConditions, ...]:
    """Return what disturbs an axis under a budget, the range of the model's error cut into parts."""
    parts = MODEL_PARTS if budget.model_error > 0.0 else 1
    reach = budget.model_error / parts
    return tuple(
        AxisConditions(
            budget.period,
            whole_periods(budget.delay, budget.period),
            budget.lag,
            budget.angle_noise,
            budget.rate_noise,
            1.0 - budget.model_error + (2 * i + 1) * reach,
            reach,
            budget.acceleration_error,
            LATE,
        )
        for i in range(parts)
    )


def whole_periods(time: float, period: float) -> int:
    """Return a time in periods, rounded up; a millionth more does not count as another period."""
    return ceil(time / period - 1e-6)


def axis_sets(row: FloatArray, conditions: Sequence[AxisConditions], entry: Entry, parts: int) -> AxisSets:
    """Bound an axis from its entry on for all times.

    Args:
        row: The axis, a row of an ``axis_table``, with a quintic funnel.
        conditions: What disturbs it: in one of these ways, but in the same one all the time.
        entry: The set in which it enters.
        parts: Into how many parts the positions at the entry are cut, each with a tube of its own.
    """
    every = []
    for one in conditions:
        every.append(_sets(row, one, entry, parts))
        if not every[-1].distance > 0.0:
            return every[-1]
    return AxisSets(
        tuple(tube for sets in every for tube in sets.tubes),
        min(sets.distance for sets in every),
        max(sets.acceleration for sets in every),
        max(sets.x_most for sets in every),
        max(sets.v_most for sets in every),
        max(sets.settled for sets in every),
        parts,
    )


def _sets(row: FloatArray, conditions: AxisConditions, entry: Entry, parts: int) -> AxisSets:
    T, delay = conditions.period, conditions.delay
    closed = max(CLOSING / row[DECAY_RATE], RAMPED / row[RAMP_RATE] if row[RAMP_RATE] > 0.0 else 0.0)
    samples = ceil(max(closed, row[FADING_TIME]) / T) + delay + 1
    half = 0.5 * (entry.upper - entry.lower) / parts
    fast, reach = 0.5 * (entry.rate_lower + entry.rate_upper), 0.5 * (entry.rate_upper - entry.rate_lower)
    middle, pushed = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER]), (entry.acceleration, entry.history)
    tubes, ends = [], np.zeros(3)
    for i in range(parts):
        tube = np.zeros((samples, COLUMNS))
        start = float(entry.lower + (2 * i + 1) * half), fast, float(half), reach, *pushed
        if not follow_tube(row, conditions, start, tube):
            return AxisSets((), 0.0)
        tubes.append(tube)
        last = tube[-1 - delay :]
        away = np.abs(last[:, X] - middle) + last[:, X_REACH], np.abs(last[:, V]) + last[:, V_REACH]
        ends = np.maximum(ends, [away[0].max(), away[1].max(), last[:, ACCELERATION].max()])
    time = (samples - 1) * T
    box = float(ends[0]), float(ends[1]), float(ends[2])
    distance, fastest, x_most, v_most, settled = settle(row, conditions, time, box)
    return AxisSets(
        tuple(tubes),
        min(distance, *(float(tube[:, DISTANCE].min()) for tube in tubes)),
        max(fastest, *(float(tube[:, ACCELERATION].max()) for tube in tubes)),
        x_most,
        v_most,
        settled,
    )


def needed_energy(
    row: FloatArray, sets: AxisSets, following: FloatArray, conditions: AxisConditions
) -> float:
    """Return the energy V below which the next transition must be allowed to begin, so that it does begin.

    Args:
        row: The axis in this cell.
        sets: Its sets.
        following: The axis in the next cell.
        conditions: What disturbs it.
    """
    middle = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    away = sets.settled + conditions.position_noise
    width = following[SLICE_UPPER] - following[SLICE_LOWER]
    shares = np.clip((middle + np.array([-away, away]) - following[SLICE_LOWER]) / width, 1e-9, 1.0 - 1e-9)
    s = np.abs(np.log(shares / (1.0 - shares))).max()
    rate = sets.v_most + conditions.rate_noise
    return float(0.5 * following[LOG_GAIN] * s * s + 0.5 * rate * rate)


def becomes_ready(row: FloatArray, sets: AxisSets, conditions: AxisConditions) -> bool:
    """Whether an axis ends where it counts as arrived in its goal interval, whatever is measured."""
    half = 0.5 * (row[GOAL_UPPER] - row[GOAL_LOWER]) * (1.0 - 2.0 * EROSION)
    return bool(sets.settled + conditions.position_noise < half)


def next_entry(
    row: FloatArray,
    sets: AxisSets,
    entry: Entry,
    following: FloatArray,
    conditions: AxisConditions,
    report_periods: int,
) -> Entry:
    """Return the set in which an axis can enter the next cell.

    It was measured inside the eroded goal interval and with a V below the bound; since then the measurement's
    delay has passed, the time for which a report may be used, and a period. In that time it went no farther
    than its largest acceleration allows, and it has stayed in its tube.

    Args:
        row: The axis in this cell.
        sets: Its sets.
        entry: The set in which it entered this cell.
        following: The axis in the next cell.
        conditions: What disturbs it.
        report_periods: How long a report may be used, in periods.
    """
    erosion = EROSION * (row[GOAL_UPPER] - row[GOAL_LOWER])
    s = sqrt(2.0 * following[ENERGY_BOUND] / following[LOG_GAIN])
    share, width = 1.0 / (1.0 + exp(min(s, 700.0))), following[SLICE_UPPER] - following[SLICE_LOWER]
    low = max(row[GOAL_LOWER] + erosion, following[SLICE_LOWER] + share * width) - conditions.position_noise
    high = min(row[GOAL_UPPER] - erosion, following[SLICE_UPPER] - share * width) + conditions.position_noise
    fast = sqrt(2.0 * following[ENERGY_BOUND]) + conditions.rate_noise
    middle = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    settled = max(float(tube[-1, ACCELERATION]) for tube in sets.tubes)
    parts = [(middle - sets.x_most, middle + sets.x_most, -sets.v_most, sets.v_most, settled)]
    parts += [
        _switching(tube, (low, high, fast), conditions, report_periods, float(row[FADING_TIME]))
        for tube in sets.tubes
    ]
    lows, highs, slow, quick, pushed = np.array(parts).T
    fresh = max(float(tube[conditions.late :, ACCELERATION].max()) for tube in sets.tubes)
    return Entry(
        float(max(lows.min(), following[SLICE_LOWER])),
        float(min(highs.max(), following[SLICE_UPPER])),
        float(slow.min()),
        float(quick.max()),
        float(pushed.max()),
        max(fresh, entry.acceleration),
    )


def _switching(
    tube: FloatArray,
    ready: tuple[float, float, float],
    conditions: AxisConditions,
    report_periods: int,
    fading: float,
) -> tuple[float, float, float, float, float]:
    """Return the states in which a tube can be when the cell is switched, after its hand-over."""
    low, high, fast = ready
    x_low, x_high = tube[:, X] - tube[:, X_REACH], tube[:, X] + tube[:, X_REACH]
    v_low, v_high = tube[:, V] - tube[:, V_REACH], tube[:, V] + tube[:, V_REACH]
    reported = (x_low <= high) & (x_high >= low) & (v_low <= fast) & (v_high >= -fast)
    reported[0] = True  # reports may rest on measurements from before the entry
    since = conditions.delay + report_periods + 1
    possible = np.convolve(reported, np.ones(since + 1))[: len(tube)] > 0.5
    possible[: ceil(fading / conditions.period - 1e-6)] = False
    pushed = float(tube[conditions.late :, ACCELERATION][possible[conditions.late :]].max())
    time = since * conditions.period
    farther = time * (fast + 0.5 * time * pushed)
    faster = fast + time * pushed
    return (
        max(float(x_low[possible].min()), low - farther),
        min(float(x_high[possible].max()), high + farther),
        max(float(v_low[possible].min()), -faster),
        min(float(v_high[possible].max()), faster),
        pushed,
    )
