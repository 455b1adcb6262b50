"""When an axis may leave its cell, and the set of states in which it can enter the next one."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np
from numpy.typing import NDArray

from coop_drake.laws.axis_table import GOAL_LOWER, GOAL_UPPER, LEAVING_TIME, REST_RATE, REST_REACH
from coop_drake.robustness.nominal_axes import (
    ACCELERATION,
    V_REACH,
    X_REACH,
    AxisConditions,
    AxisSets,
    Entry,
    V,
    X,
)
from coop_drake.tree.arrays import FloatArray

EARLIER = 4
"""By how many samples earlier a cell may be left than the tubes say [-]: rounding moves rests by far less."""

LOWEST, HIGHEST = [0, 2], [1, 3, 4, 5]
"""Which of the numbers of an entry set are lower bounds, and which upper ones."""


def next_entry(row: FloatArray, sets: AxisSets, conditions: AxisConditions, report_periods: int) -> Entry:
    """Return the set in which an axis can enter the next cell.

    Its motion was at rest when a report was made; since then the time for which reports may be used has
    passed, and a period. In that time it went no farther than its largest acceleration allows, and it has
    stayed in its tube.

    Args:
        row: The axis in this cell, with the condition of rest under which the cell is left.
        sets: Its sets.
        conditions: How its motion is computed.
        report_periods: How long a report may be used, in periods.
    """
    middle = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    rest, since = (float(row[REST_REACH]), float(row[REST_RATE])), report_periods + 1
    time = since * conditions.period
    before = max(sets.last, *(float(tube[-1 - since :, ACCELERATION].max()) for tube in sets.tubes))
    x, v = sets.settled, sets.settled_rate
    bounds = np.array([middle - x, middle + x, -v, v, sets.last, before])
    _limit(bounds, middle, rest, time)
    leaving = ceil(row[LEAVING_TIME] / conditions.period - 1e-6)
    for tube in sets.tubes:
        found = _switching(tube, middle, rest, (since, leaving))
        if found[0] <= found[1]:
            _limit(found, middle, rest, time)
            bounds[LOWEST] = np.minimum(bounds[LOWEST], found[LOWEST])
            bounds[HIGHEST] = np.maximum(bounds[HIGHEST], found[HIGHEST])
    low, high, slow, quick, pushed = bounds[:5].tolist()
    return Entry(low, high, slow, quick, pushed, middle)


def first_leaving(table: FloatArray, every: Sequence[AxisSets], period: float) -> int:
    """Return the first sample at which all axes of a transition can have come to rest and its cell be left.

    Args:
        table: The axes, with the condition of rest under which the cell is left.
        every: Their sets.
        period: T [s].
    """
    stay: int = ceil(table[0, LEAVING_TIME] / period - 1e-6)
    first = stay
    for row, sets in zip(table, every, strict=True):
        middle, rest = (
            0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER]),
            (float(row[REST_REACH]), float(row[REST_RATE])),
        )
        first = max(first, min(_first_rest(tube, middle, rest, stay) for tube in sets.tubes))
    return max(stay, first - EARLIER)


def _rests(tube: FloatArray, middle: float, rest: tuple[float, float]) -> NDArray[np.bool_]:
    """Return whether a motion can be at rest at every sample of a tube, shape (samples,)."""
    near = np.abs(tube[:, X] - middle) <= rest[0] + tube[:, X_REACH]
    slow: NDArray[np.bool_] = np.abs(tube[:, V]) <= rest[1] + tube[:, V_REACH]
    return near & slow


def _first_rest(tube: FloatArray, middle: float, rest: tuple[float, float], first: int) -> int:
    """Return the first sample of a tube from another one on at which a motion can be at rest, or its end."""
    found = np.flatnonzero(_rests(tube[first:], middle, rest))
    return first + int(found[0]) if found.size else max(first, len(tube))


def _limit(bounds: FloatArray, middle: float, rest: tuple[float, float], time: float) -> None:
    """Cut bounds of states to where a motion can be that was at rest some time ago."""
    farther = rest[0] + time * (rest[1] + 0.5 * time * bounds[5])
    faster = rest[1] + time * bounds[5]
    bounds[0], bounds[1] = max(bounds[0], middle - farther), min(bounds[1], middle + farther)
    bounds[2], bounds[3] = max(bounds[2], -faster), min(bounds[3], faster)


def _switching(
    tube: FloatArray, middle: float, rest: tuple[float, float], samples: tuple[int, int]
) -> FloatArray:
    """Return bounds of x and v, the largest |x''|, and that since the report, when a tube can be left.

    The lowest x is above the highest one if it cannot be left before its end.

    Args:
        tube: The tube.
        middle: Where the axis rests [rad or m].
        rest: Distance and rate within which the axis counts as at rest [rad or m, rad/s or m/s].
        samples: For how many samples a report may be used, and the first sample of a report.

    Returns:
        Shape (6,): lowest and highest x, lowest and highest v, the two accelerations.
    """
    since, leaving = samples
    part, numbers = tube[leaving:], np.arange(leaving, len(tube))
    reported = np.maximum.accumulate(np.where(_rests(part, middle, rest), numbers, -since - 1))
    leaves = numbers - reported <= since
    if not leaves.any():
        return np.array([np.inf, -np.inf, np.inf, -np.inf, 0.0, 0.0])
    # Samples from which on it is left within the time for which a report may be used.
    left = np.concatenate([[0], np.cumsum(leaves), np.full(since, np.count_nonzero(leaves))])
    soon = left[since + 1 :] > left[: len(part)]
    here, pushed = part[leaves], part[:, ACCELERATION]
    x, v = here[:, X] - middle, here[:, V]
    return np.array([
        (middle + x - here[:, X_REACH]).min(), (middle + x + here[:, X_REACH]).max(),
        (v - here[:, V_REACH]).min(), (v + here[:, V_REACH]).max(),
        pushed[leaves].max(), pushed[soon].max(),
    ])  # fmt: skip
