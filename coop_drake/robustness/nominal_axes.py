"""All nominal motions of one axis that enter a cell from a set, until the next cell is entered.

A tube surrounds the motion from the set's middle. The sampled axis is linear but for its law: over a control
period T the command u is held, and a first-order lag lets the acceleration p follow it, so that the state
(x, v, p) is carried over exactly. The law is a line about the motion from the middle plus a bounded rest, see
``funnel_law``. By superposition the departure of the state is the sum of its responses to the departure at
entry and to every sample's rest, each bounded by the size of that times the magnitude of the response. The
rest of a sample depends only on departures before it, so that one pass forward in time bounds all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coop_drake.jit import compiled
from coop_drake.laws.axis_table import (
    ACCELERATION_LIMIT,
    GOAL_LOWER,
    GOAL_UPPER,
    LEAVING_TIME,
    LIMIT_GAIN,
    RATE_LIMIT,
    REST_RATE,
    REST_REACH,
    bounds_of,
)
from coop_drake.laws.nominal import lag_factors
from coop_drake.robustness.funnel_law import (
    MEMORY,
    closed_after,
    command_near,
    jump_at,
    line_at_rest,
    slowest_rate,
)
from coop_drake.tree.arrays import FloatArray

X, X_REACH, V, V_REACH, ACCELERATION, DISTANCE, COMMAND, COMMAND_REACH = range(8)
COLUMNS = 8
"""Columns of a tube, a row for every sample: x and the most that it may depart [rad or m], v and the most
that it may depart [rad/s or m/s], the largest |acceleration| until the next sample, the least distance to the
funnel's bounds until then, and the command and the most that it may depart [rad/s^2 or m/s^2]."""

DIVERGED = 1e3
"""A departure beyond this ends the pass [rad or m]."""


class AxisConditions(NamedTuple):
    """How the nominal motion of an axis is computed.

    Attributes:
        period: T [s].
        lag: Time constant of the actuators [s].
    """

    period: float
    lag: float


LATE = 1
"""Periods for which the command of the cell before acts after a switch [-]: all robots compute at the instant
of the switch, before they hear of it."""


@compiled
def follow_tube(
    row: FloatArray,
    conditions: AxisConditions,
    entry: tuple[float, float, float, float, float],
    jump: float,
    tube: FloatArray,
) -> bool:
    """Write the tube of an axis from its entry on, and return whether it keeps inside the funnel.

    Args:
        row: The axis, a row of an ``axis_table``.
        conditions: How its motion is computed.
        entry: x and v at the entry, the most that they may depart from these, and the largest |x''| and
            command at the entry.
        jump: What is added to the command and fades, see ``switch_jump``.
        tube: Receives the tube, shape (samples, ``COLUMNS``).
    """
    T, n = conditions.period, tube.shape[0]
    responses, weight = np.zeros((3, n + 3)), np.zeros(n + 3)
    for i in range(3):  # to the departures of x, v and x'' at the entry, then to the disturbances of commands
        responses[i, i], weight[i] = 1.0, entry[2 + i]
    x, v, p, x_reach, v_reach, p_reach = entry[0], entry[1], 0.0, entry[2], entry[3], entry[4]
    lagging, memory = lag_factors(T, conditions.lag), np.empty(MEMORY)
    for k in range(n):
        state = x, x_reach, v, v_reach
        u, slope, by_rate, weight[3 + k], most = command_near(row, k * T, state, jump, memory)
        if k < LATE:  # all of the command, the old one or the new one, counts as a disturbance
            most = max(most, entry[4])
            u, slope, by_rate, weight[3 + k] = 0.0, 0.0, 0.0, most
        tube[k, COMMAND], tube[k, COMMAND_REACH] = u, most - abs(u)
        # Between two samples a motion departs from its chord by at most T^2 / 8 times its acceleration, and
        # so does a bound of the funnel.
        lower, upper, _, _, bend, other = bounds_of(row, k * T)
        _, _, _, _, next_bend, next_other = bounds_of(row, k * T + T)
        bent = max(max(abs(bend), abs(other)), max(abs(next_bend), abs(next_other)))
        tube[k, X], tube[k, X_REACH], tube[k, V], tube[k, V_REACH] = state
        fastest, nearest = max(abs(p) + p_reach, most), min(x - x_reach - lower, upper - x - x_reach)
        tube[k, ACCELERATION], tube[k, DISTANCE] = fastest, nearest - 0.125 * T * T * (fastest + bent)
        if not tube[k, DISTANCE] > 0.0 or not x_reach < DIVERGED:
            return False
        gap = p - u
        x, v = x + T * v + 0.5 * T * T * u + lagging[2] * gap, v + T * u + lagging[1] * gap
        p = u + lagging[0] * gap
        x_reach, v_reach, p_reach = _respond(responses, weight, k, (T, slope, by_rate), lagging)
    return True


@compiled(reassociate=True, borrows=True)
def _respond(
    responses: FloatArray,
    weight: FloatArray,
    k: int,
    law: tuple[float, float, float],
    lagging: tuple[float, float, float],
) -> tuple[float, float, float]:
    """Carry all responses over a period; return the sums of their magnitudes times what they respond to.

    The loop has no branches and goes through memory in order, so that vector units are used.
    """
    T, slope, by_rate = law
    left, in_v, in_x = lagging
    x, v, p, last = responses[0], responses[1], responses[2], 3 + k
    x_sum = v_sum = p_sum = 0.0
    for j in range(last):
        u = slope * x[j] + by_rate * v[j]
        gap = p[j] - u
        x[j] = x[j] + T * v[j] + 0.5 * T * T * u + in_x * gap
        v[j] = v[j] + T * u + in_v * gap
        p[j] = u + left * gap
        x_sum += abs(x[j]) * weight[j]
        v_sum += abs(v[j]) * weight[j]
        p_sum += abs(p[j]) * weight[j]
    x[last], v[last], p[last] = 0.5 * T * T - in_x, T - in_v, 1.0 - left
    x_sum += abs(x[last]) * weight[last]
    v_sum += abs(v[last]) * weight[last]
    p_sum += abs(p[last]) * weight[last]
    return x_sum, v_sum, p_sum


# Where a nominal motion stays for ever once its funnel is closed.
#
# About rest in the middle of the closed funnel the law is a line plus a rest that is bounded by W while the
# axis departs by at most X and V. The departure is then the sum of what is left of the one at the time t0,
# and of the responses to all rests since: |x| <= transient + W sum |h_x|, and so for v. The tube says how
# far the axis departs from t0 until some time constants later, when the transient has vanished but for a
# small share. If the sum is at most X and V from then on, it stays so at every later sample by induction.

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
        next_x: Largest departure at the next sample, if it was at most ``x`` before.
        next_rate: Largest rate at the next sample, likewise.
    """

    distance: float
    acceleration: float
    x: float
    rate: float
    next_x: float
    next_rate: float


def settle(
    row: FloatArray,
    conditions: AxisConditions,
    time: float,
    entry: tuple[float, float, float],
    followed: tuple[float, float],
    samples: int,
) -> Settled:
    """Return departures within which an axis stays for ever, the least of those that are tried.

    Arguments are those of ``staying``, but ``followed``: the most that x and v may depart from t0 until the
    end of the tube.
    """
    x, v = followed
    for _ in range(ATTEMPTS):
        found = staying(row, conditions, time, entry, (x, v), samples)
        if not found.distance > -np.inf:
            break
        if SPARE * found.next_x <= x and SPARE * found.next_rate <= v:
            return found
        x, v = max(x, GROWTH * found.next_x), max(v, GROWTH * found.next_rate)
    return Settled(-1.0, np.inf, np.inf, np.inf, np.inf, np.inf)


def staying(
    row: FloatArray,
    conditions: AxisConditions,
    time: float,
    entry: tuple[float, float, float],
    held: tuple[float, float],
    samples: int,
) -> Settled:
    """Return how far an axis departs at the next sample if it departed by no more than this before.

    It then stays within these departures for ever if they are no less than the ones at the next sample. The
    gain k1 may still grow a little: that is counted as a disturbance.

    Args:
        row: The axis, a row of an ``axis_table``.
        conditions: How its motion is computed.
        time: t0, not before the funnel is closed [s].
        entry: The most that x, v and x'' may depart from the middle, from rest and from zero at t0.
        held: The most that x and v may have departed at any sample.
        samples: Number of samples from t0 to the end of the tube, see ``tail_samples``.
    """
    lower, upper = bounds_of(row, time)[:2]
    half, T, (x, v) = 0.5 * (upper - lower), conditions.period, held
    if not x < half:
        return Settled(-np.inf, np.inf, x, v, np.inf, np.inf)
    slope, by_rate, size, most = line_at_rest(row, time, x, v)
    fastest = max(most, entry[2])
    sums = _response_sums(conditions, slope, by_rate, entry, samples)
    x_next, v_next = (sums[0] + sums[1] * size).tolist()
    return Settled(half - x - 0.125 * T * T * fastest, fastest, x, v, x_next, v_next)


def tail_samples(row: FloatArray, conditions: AxisConditions) -> int:
    """Return for how many samples an axis is followed after its funnel is closed, ``TIME_CONSTANTS`` long."""
    return ceil(TIME_CONSTANTS / (slowest_rate(row) * conditions.period)) + 2


@compiled
def _response_sums(
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


@dataclass(frozen=True)
class Entry:
    """The set of states in which an axis enters a transition.

    Attributes:
        lower: Lowest position [rad or m].
        upper: Highest position [rad or m].
        rate_lower: Lowest rate [rad/s or m/s].
        rate_upper: Highest rate [rad/s or m/s].
        acceleration: Largest magnitude of acceleration and command at the entry [rad/s^2 or m/s^2].
        rest: Position at which the last cell is left at rest, for which ``switch_jump`` is computed [rad
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
        needed: The least departure and rate that follow from ``settled`` and ``settled_rate``, which hold for
            ever where they are no less.
    """

    tubes: tuple[FloatArray, ...]
    distance: float
    acceleration: float = np.inf
    last: float = np.inf
    settled: float = np.inf
    settled_rate: float = np.inf
    parts: int = 1
    settled_distance: float = 0.0
    needed: tuple[float, float] = (np.inf, np.inf)

    def spare(self, departures: FloatArray) -> float:
        """Return the least distance to the funnel's bounds of an axis that departs [rad or m].

        Args:
            departures: Its largest departures in all periods, the last one for ever, shape (periods + 1,).
        """
        return float((self.distances(len(departures) - 1) - departures).min())

    def distances(self, samples: int) -> FloatArray:
        """Return the least distance in all periods, the last one for ever, shape (samples + 1,)."""
        least = np.full(samples + 1, np.inf)
        for tube in self.tubes:
            least[: len(tube)] = np.minimum(least[: len(tube)], tube[:, DISTANCE])
        ended = min(len(tube) for tube in self.tubes)
        least[ended:] = np.minimum(least[ended:], self.settled_distance)
        return least

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


def axis_sets(
    row: FloatArray,
    conditions: AxisConditions,
    entry: Entry,
    parts: int,
    settled: tuple[float, float] | None = None,
) -> AxisSets:
    """Bound a nominal motion from its entry on for all times.

    Args:
        row: The axis, a row of an ``axis_table``, with a quintic funnel.
        conditions: How its motion is computed.
        entry: The set in which it enters.
        parts: Into how many parts the positions at the entry are cut, each with a tube of its own.
        settled: Departures from the middle and rates that are stated for all times after the funnel is
            closed, of which ``needed`` tells whether they are; the least ones are looked for if not given.
    """
    T, middle = conditions.period, 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER])
    begin, tail = ceil(closed_after(row) / T), tail_samples(row, conditions)
    tubes = _tubes(row, conditions, entry, parts, begin + tail + 1)
    if not tubes:
        return AxisSets((), 0.0)
    ends = np.array([_closed_part(tube[begin:], middle) for tube in tubes]).max(axis=0).tolist()
    box = ends[0], ends[1], ends[2]
    if settled is None:
        kept = settle(row, conditions, begin * T, box, (ends[3], ends[4]), tail)
    else:
        kept = staying(row, conditions, begin * T, box, settled, tail)
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
        (max(ends[3], kept.next_x), max(ends[4], kept.next_rate)),
    )


def _closed_part(tube: FloatArray, middle: float) -> tuple[float, float, float, float, float]:
    """Return |x - middle|, |v| and |x''| of the first sample, and the largest of the first two of all."""
    away, fast = np.abs(tube[:, X] - middle) + tube[:, X_REACH], np.abs(tube[:, V]) + tube[:, V_REACH]
    return away[0], fast[0], tube[0, ACCELERATION], away.max(), fast.max()


def _tubes(
    row: FloatArray, conditions: AxisConditions, entry: Entry, parts: int, samples: int
) -> list[FloatArray]:
    """Return the tubes of all parts of the positions at the entry, none if one leaves the funnel."""
    half = 0.5 * (entry.upper - entry.lower) / parts
    fast, reach = 0.5 * (entry.rate_lower + entry.rate_upper), 0.5 * (entry.rate_upper - entry.rate_lower)
    rest = 0.5 * (entry.lower + entry.upper) if entry.rest is None else entry.rest
    tubes, jump = [], jump_at(row, rest)
    for i in range(parts):
        tube = np.zeros((samples, COLUMNS))
        start = float(entry.lower + (2 * i + 1) * half), fast, float(half), reach, entry.acceleration
        if not follow_tube(row, conditions, start, jump, tube):
            return []
        tubes.append(tube)
    return tubes


def comes_near_limit(row: FloatArray, sets: AxisSets) -> bool:
    """Return whether a x' <= g (L^2 - x'^2) / 2 or |a| <= A may fail for a nominal motion.

    Sets are those of the law without limits; they hold with these where none acts at any time.

    Args:
        row: The axis, a row of an ``axis_table``.
        sets: Its sets.
    """
    limit = row[RATE_LIMIT]
    if not min(limit, row[ACCELERATION_LIMIT]) < np.inf:
        return False
    rates = np.concatenate(
        [[sets.settled_rate], *(np.abs(tube[:, V]) + tube[:, V_REACH] for tube in sets.tubes)]
    )
    accelerations = np.concatenate([[sets.last], *(tube[:, ACCELERATION] for tube in sets.tubes)])
    if (accelerations > row[ACCELERATION_LIMIT]).any():
        return True
    if not limit < np.inf:
        return False
    return bool((rates * accelerations > 0.5 * row[LIMIT_GAIN] * (limit * limit - rates * rates)).any())


def even_sets(samples: int, acceleration: float, rate: float, period: float) -> AxisSets:
    """Return the sets of an axis that moves within the same acceleration and rate at all times."""
    tube = np.zeros((samples, COLUMNS))
    tube[:, ACCELERATION], tube[:, V] = acceleration, rate - period * acceleration
    return AxisSets((tube,), 0.0, acceleration, acceleration, 0.0, tube[0, V])


# When an axis may leave its cell, and the set of states in which it can enter the next one.

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
        found = _switching(tube, middle, rest, since, leaving)
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
        middle, rest = 0.5 * (row[GOAL_LOWER] + row[GOAL_UPPER]), (row[REST_REACH], row[REST_RATE])
        found = [(len(tube), np.flatnonzero(_rests(tube[stay:], middle, rest))) for tube in sets.tubes]
        first = max(first, min(stay + int(at[0]) if at.size else end for end, at in found))
    return max(stay, first - EARLIER)


def _rests(tube: FloatArray, middle: float, rest: tuple[float, float]) -> NDArray[np.bool_]:
    """Return whether a motion can be at rest at every sample of a tube, shape (samples,)."""
    near: NDArray[np.bool_] = np.abs(tube[:, X] - middle) <= rest[0] + tube[:, X_REACH]
    return near & (np.abs(tube[:, V]) <= rest[1] + tube[:, V_REACH])


def _limit(bounds: FloatArray, middle: float, rest: tuple[float, float], time: float) -> None:
    """Cut bounds of states to where a motion can be that was at rest some time ago."""
    farther, faster = rest[0] + time * (rest[1] + 0.5 * time * bounds[5]), rest[1] + time * bounds[5]
    bounds[0], bounds[1] = max(bounds[0], middle - farther), min(bounds[1], middle + farther)
    bounds[2], bounds[3] = max(bounds[2], -faster), min(bounds[3], faster)


def _switching(
    tube: FloatArray, middle: float, rest: tuple[float, float], since: int, leaving: int
) -> FloatArray:
    """Return bounds of x and v, the largest |x''|, and that since the report, when a tube can be left.

    The lowest x is above the highest one if it cannot be left before its end.

    Args:
        tube: The tube.
        middle: Where the axis rests [rad or m].
        rest: Distance and rate within which the axis counts as at rest [rad or m, rad/s or m/s].
        since: For how many samples a report may be used.
        leaving: The first sample of a report.

    Returns:
        Shape (6,): lowest and highest x, lowest and highest v, the two accelerations.
    """
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
