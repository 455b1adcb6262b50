"""The sets of one axis in one transition, and the set in which it can enter the next one."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import DECAY_RATE, FADING_TIME, GOAL_LOWER, GOAL_UPPER, RAMP_RATE, track_row
from coop_drake.laws.ppc import CLOSING
from coop_drake.planning.budget.axis_tube import (
    ACCELERATION,
    COLUMNS,
    COMMAND,
    COMMAND_REACH,
    DISTANCE,
    V_REACH,
    X_REACH,
    AxisConditions,
    V,
    X,
    follow_tube,
)
from coop_drake.planning.budget.settled import settle, tail_samples
from coop_drake.tree.pose import FloatArray

RAMPED = 6.0
"""mu t after which the gain k1 counts as ramped in [-]: a sixtieth of it is missing then."""


@dataclass(frozen=True)
class Entry:
    """The set of states in which an axis enters a transition.

    Attributes:
        lower: Lowest position [rad or m].
        upper: Highest position [rad or m].
        rate_lower: Lowest rate [rad/s or m/s].
        rate_upper: Highest rate [rad/s or m/s].
        acceleration: Largest magnitude of acceleration and command at the entry [rad/s^2 or m/s^2].
        rest: Position at which the last cell is left at rest, for which ``rest_jump`` is computed [rad
            or m]; the middle of the positions if not given.
    """

    lower: float
    upper: float
    rate_lower: float = 0.0
    rate_upper: float = 0.0
    acceleration: float = 0.0
    rest: float | None = None


@dataclass(frozen=True)
class AxisSets:
    """What follows for one axis in one transition.

    Attributes:
        tubes: Of every part of the entry set, shape (samples, ``COLUMNS``).
        distance: Least distance to the funnel's bounds at all times [rad or m]; not positive if none is
            shown.
        acceleration: Largest magnitude of the acceleration [rad/s^2 or m/s^2].
        last: Largest magnitude of the acceleration once the funnel is closed [rad/s^2 or m/s^2].
        settled: Largest departure from the goal interval's middle once the funnel is closed [rad or m].
        settled_rate: Largest rate once the funnel is closed [rad/s or m/s].
        parts: Into how many parts the positions at the entry were cut.
        settled_distance: As ``distance``, once the funnel is closed.
    """

    tubes: tuple[FloatArray, ...]
    distance: float
    acceleration: float = np.inf
    last: float = np.inf
    settled: float = np.inf
    settled_rate: float = np.inf
    parts: int = 1
    settled_distance: float = 0.0

    def spare(self, departures: FloatArray) -> float:
        """Return the least distance to the funnel's bounds of an axis that departs [rad or m].

        Args:
            departures: Its largest departures in all periods, the last one for ever, shape (periods + 1,).
        """
        distances = [tube[:, DISTANCE] - departures[: len(tube)] for tube in self.tubes]
        least = min(float(some.min()) for some in distances)
        ended = min(len(tube) for tube in self.tubes)
        return min(least, self.settled_distance - float(departures[ended:].max()))

    def moving(self, samples: int, period: float) -> FloatArray:
        """Return the largest |x''| and |x'| in all periods, the last one for ever, shape (2, samples + 1)."""
        moving = np.repeat([[self.last], [self.settled_rate]], samples + 1, axis=1)
        for tube in self.tubes:
            now = np.array([tube[:, ACCELERATION], np.abs(tube[:, V]) + tube[:, V_REACH]])
            moving[:, : len(tube)] = np.maximum(moving[:, : len(tube)], now)
        moving[1] += period * moving[0]
        return moving

    def commands(self, samples: int) -> FloatArray:
        """Return the least and the largest command of every period, the last for ever, (2, samples + 1)."""
        bounds = np.repeat([[np.inf], [-np.inf]], samples + 1, axis=1)
        for tube in self.tubes:
            n, middle, reach = len(tube), tube[:, COMMAND], tube[:, COMMAND_REACH]
            bounds[0, :n] = np.minimum(bounds[0, :n], middle - reach)
            bounds[1, :n] = np.maximum(bounds[1, :n], middle + reach)
            bounds[0, n:] = np.minimum(bounds[0, n:], -self.last)
            bounds[1, n:] = np.maximum(bounds[1, n:], self.last)
        return bounds

    def fastest(self, departures: FloatArray, period: float) -> float:
        """Return the largest rate of an axis whose rate departs by these, as for ``spare`` [rad/s or m/s]."""
        return float((self.moving(len(departures) - 1, period)[1] + departures).max())


def axis_sets(row: FloatArray, conditions: AxisConditions, entry: Entry, parts: int) -> AxisSets:
    """Bound a nominal motion from its entry on for all times.

    Args:
        row: The axis, a row of an ``axis_table``, with a quintic funnel.
        conditions: How the motion is computed.
        entry: The set in which it enters.
        parts: Into how many parts the positions at the entry are cut, each with a tube of its own.
    """
    T, middle = conditions.period, 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    closed = max(CLOSING / row[DECAY_RATE], RAMPED / row[RAMP_RATE] if row[RAMP_RATE] > 0.0 else 0.0)
    begin, tail = ceil(max(closed, row[FADING_TIME]) / T), tail_samples(row, conditions)
    tubes = _tubes(row, conditions, entry, parts, begin + tail + 1)
    if not tubes:
        return AxisSets((), 0.0)
    ends = np.array([_closed_part(tube[begin:], middle) for tube in tubes]).max(axis=0).tolist()
    kept = settle(row, conditions, begin * T, (ends[0], ends[1], ends[2]), (ends[3], ends[4]), tail)
    most = max(kept.acceleration, *(float(tube[:, ACCELERATION].max()) for tube in tubes))
    return AxisSets(
        tuple(tubes),
        min(kept.distance, *(float(tube[:, DISTANCE].min()) for tube in tubes)),
        most,
        kept.acceleration,
        kept.x,
        kept.rate,
        parts,
        kept.distance,
    )


@compiled(borrows=True)
def _closed_part(tube: FloatArray, middle: float) -> tuple[float, float, float, float, float]:
    """Return |x - middle|, |v| and |x''| of the first sample, and the largest of the first two of all."""
    x = v = 0.0
    for k in range(len(tube)):
        x = max(x, abs(tube[k, X] - middle) + tube[k, X_REACH])
        v = max(v, abs(tube[k, V]) + tube[k, V_REACH])
    first = tube[0]
    return abs(first[X] - middle) + first[X_REACH], abs(first[V]) + first[V_REACH], first[ACCELERATION], x, v


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
        start = middle, fast, float(half), reach, entry.acceleration
        if not follow_tube(row, conditions, start, jump, tube):
            return []
        tubes.append(tube)
    return tubes
