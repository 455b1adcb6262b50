"""The sets of one axis in one transition, and the set in which it can enter the next one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.compiled import compiled
from coop_drake.laws.axis_table import (
    DECAY_RATE,
    FADING_TIME,
    GOAL_LOWER,
    GOAL_UPPER,
    RAMP_RATE,
    track_row,
)
from coop_drake.laws.funnels import CLOSING
from coop_drake.laws.sampling import whole_periods
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
from coop_drake.planning.budget.settled import Settled, settle, tail_samples
from coop_drake.tree.pose import FloatArray

RAMPED = 6.0
"""mu t after which the gain k1 counts as ramped in [-]: a sixtieth of it is missing then."""

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
        history: Largest magnitude of the acceleration before the entry, over the age of the measurements and
            reports that are used at the entry [rad/s^2 or m/s^2].
        rest: Position at which the last cell is left at rest, for which ``rest_jump`` is computed [rad
            or m]; the middle of the positions if not given.
    """

    lower: float
    upper: float
    rate_lower: float = 0.0
    rate_upper: float = 0.0
    acceleration: float = 0.0
    history: float = 0.0
    rest: float | None = None


@dataclass(frozen=True)
class AxisSets:
    """What follows for one axis in one transition.

    Attributes:
        tubes: Of every part of the entry set, shape (samples, ``COLUMNS``).
        distance: Least distance to the funnel's bounds at all times [rad or m]; not positive if none is
            shown.
        acceleration: Largest magnitude of the acceleration [rad/s^2 or m/s^2].
        rate: Largest magnitude of the rate, between samples, too [rad/s or m/s].
        last: Largest magnitude of the acceleration once the funnel is closed [rad/s^2 or m/s^2].
        settled: Largest departure from the goal interval's middle once the funnel is closed [rad or m].
        settled_rate: Largest rate once the funnel is closed [rad/s or m/s].
        parts: Into how many parts the positions at the entry were cut.
    """

    tubes: tuple[FloatArray, ...]
    distance: float
    acceleration: float = np.inf
    rate: float = np.inf
    last: float = np.inf
    settled: float = np.inf
    settled_rate: float = np.inf
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


def axis_sets(row: FloatArray, conditions: Sequence[AxisConditions], entry: Entry, parts: int) -> AxisSets:
    """Bound an axis from its entry on for all times.

    Args:
        row: The axis, a row of an ``axis_table``, with a quintic funnel.
        conditions: Alternatives for what disturbs it; one of them holds during the whole transition.
        entry: The set in which it enters.
        parts: Into how many parts the positions at the entry are cut, each with a tube of its own.
    """
    T, delay = conditions[0].period, conditions[0].delay
    closed = max(CLOSING / row[DECAY_RATE], RAMPED / row[RAMP_RATE] if row[RAMP_RATE] > 0.0 else 0.0)
    begin = ceil(max(closed, row[FADING_TIME]) / T) + delay
    tail, middle = tail_samples(row, conditions[0]), 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    tubes, boxes, followed = [], [], (0.0, 0.0)
    for one in conditions:
        made = _tubes(row, one, entry, parts, begin + tail + 1)
        if not made:
            return AxisSets((), 0.0)
        ends = np.array([_closed_part(tube[begin - delay :], middle, delay) for tube in made]).max(axis=0)
        boxes.append((float(ends[0]), float(ends[1]), float(ends[2])))
        followed = max(followed[0], float(ends[3])), max(followed[1], float(ends[4]))
        tubes += made
    kept = _settled(row, conditions, begin * T, boxes, followed, tail)
    last = max(one.acceleration for one in kept)
    most = max(last, *(float(tube[:, ACCELERATION].max()) for tube in tubes))
    rate = max(kept[0].rate, *(float((np.abs(tube[:, V]) + tube[:, V_REACH]).max()) for tube in tubes))
    return AxisSets(
        tuple(tubes),
        min(*(one.distance for one in kept), *(float(tube[:, DISTANCE].min()) for tube in tubes)),
        most,
        rate + 0.5 * T * most,
        last,
        kept[0].x,
        kept[0].rate,
        parts,
    )


@compiled
def _closed_part(tube: FloatArray, middle: float, delay: int) -> tuple[float, float, float, float, float]:
    """Return the largest |x - middle|, |v| and |x''| of the first samples, and of all the first two."""
    x = v = pushed = x_all = v_all = 0.0
    for k in range(len(tube)):
        x_all = max(x_all, abs(tube[k, X] - middle) + tube[k, X_REACH])
        v_all = max(v_all, abs(tube[k, V]) + tube[k, V_REACH])
        if k <= delay:
            x, v, pushed = x_all, v_all, max(pushed, tube[k, ACCELERATION])
    return x, v, pushed, x_all, v_all


def _settled(
    row: FloatArray,
    conditions: Sequence[AxisConditions],
    time: float,
    boxes: Sequence[tuple[float, float, float]],
    followed: tuple[float, float],
    samples: int,
) -> list[Settled]:
    """Return ``settle`` of every condition, for the same departures x and v."""
    while True:
        kept = [
            settle(row, one, time, box, followed, samples) for one, box in zip(conditions, boxes, strict=True)
        ]
        largest = max(one.x for one in kept), max(one.rate for one in kept)
        if largest == followed or not max(largest) < np.inf:
            return kept
        followed = largest


def _tubes(
    row: FloatArray, conditions: AxisConditions, entry: Entry, parts: int, samples: int
) -> list[FloatArray]:
    """Return the tubes of all parts of the positions at the entry, none if one leaves the funnel."""
    half = 0.5 * (entry.upper - entry.lower) / parts
    fast, reach = 0.5 * (entry.rate_lower + entry.rate_upper), 0.5 * (entry.rate_upper - entry.rate_lower)
    rest = 0.5 * (entry.lower + entry.upper) if entry.rest is None else entry.rest
    tubes, jump = [], -track_row(row, 0.0, rest, 0.0)[0]
    for i in range(parts):
        tube = np.zeros((samples, COLUMNS))
        middle = float(entry.lower + (2 * i + 1) * half)
        start = middle, fast, float(half), reach, entry.acceleration, entry.history
        if not follow_tube(row, conditions, start, jump, tube):
            return []
        tubes.append(tube)
    return tubes
