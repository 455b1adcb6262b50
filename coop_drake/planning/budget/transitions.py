"""All axes from transition to transition: from one entry set of a nominal motion follows the next one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coop_drake.laws.axis_table import (
    ACCELERATION_LIMIT,
    GOAL_LOWER,
    GOAL_UPPER,
    LEAVING_TIME,
    RATE_LIMIT,
    REST_RATE,
    REST_REACH,
)
from coop_drake.laws.readiness import EROSION
from coop_drake.laws.sampling import whole_periods
from coop_drake.planning.budget.axis_departure import SLACK, AxisLoop, near_accelerations
from coop_drake.planning.budget.axis_sets import AxisSets, Entry, axis_sets
from coop_drake.planning.budget.axis_tube import AxisConditions
from coop_drake.planning.budget.leaving import next_entry
from coop_drake.planning.budget.rate_room import comes_near_limit
from coop_drake.tree.pose import FloatArray

REST_SHARE = 0.05
"""Largest distance from the middle of a goal interval with which a nominal motion may leave a cell, over the
interval's width [-]: the less, the smaller is the entry set of the next cell, and the longer it takes."""

REST_SPEED = 0.03
"""Largest rate with which a nominal motion may leave a cell [rad/s or m/s]."""

REST_FACTOR = 1.5
"""Least distance and rate with which a cell may be left, over the largest ones of a settled motion [-]."""

ENTRY_PARTS = (1, 3)
"""Parts into which the positions at an entry are cut, tried in this order [-]."""


@dataclass(frozen=True)
class UnprovedTransition:
    """The first transition for which a budget cannot be shown to hold.

    Attributes:
        transition: Index of the transition.
        axis: Index of the axis, theta being 0.
        reason: What cannot be shown, in words.
    """

    transition: int
    axis: int
    reason: str


@dataclass(frozen=True)
class ProvedTransition:
    """One transition for which a budget holds.

    Attributes:
        table: Its axes, an ``axis_table`` with the condition of rest under which the cell is left.
        entries: The sets in which their nominal motions enter.
        sets: What follows for these.
        departure: Largest departures from them, shape (axes,) [rad or m].
        rate_departure: Largest departures of the rates, shape (axes,) [rad/s or m/s].
    """

    table: FloatArray
    entries: Sequence[Entry]
    sets: Sequence[AxisSets]
    departure: FloatArray
    rate_departure: FloatArray


def follow_transitions(
    tables: Sequence[FloatArray], start: FloatArray, loop: AxisLoop
) -> list[ProvedTransition] | UnprovedTransition:
    """Follow all axes through transitions: their nominal motions, and how far they depart from these.

    Args:
        tables: The axes in every transition, each an ``axis_table`` with quintic funnels.
        start: Where they rest at the beginning, shape (axes,) [rad or m].
        loop: The loop that pulls the axes to their nominal motions, with the budget.
    """
    budget, proved = loop.budget, list[ProvedTransition]()
    conditions, periods = (
        AxisConditions(budget.period, budget.lag),
        whole_periods(budget.report_age, budget.period),
    )
    for k, table in enumerate(tables):
        found = _proved(k, table.copy(), _entries(proved, start, conditions, periods), conditions)
        if isinstance(found, UnprovedTransition):
            return found
        proved.append(found)
    return _departing(proved, loop)


def _departing(
    proved: Sequence[ProvedTransition], loop: AxisLoop
) -> list[ProvedTransition] | UnprovedTransition:
    """Return the transitions with the departures of their axes; or where these leave a funnel or a limit."""
    accelerations = [(1.0 + SLACK) * np.array([sets.acceleration for sets in each.sets]) for each in proved]
    stays = [float(each.table[0, LEAVING_TIME]) for each in proved]
    largest, result = np.max(accelerations, axis=0), []
    for k, each in enumerate(proved):
        near = near_accelerations(accelerations, stays, k)
        departure, rate_departure, push = loop.departures(near, largest)
        for axis, sets in enumerate(each.sets):
            if not (1.0 - SLACK) * sets.distance > departure[axis]:
                return UnprovedTransition(k, axis, "may leave its funnel")
            if not (1.0 + SLACK) * sets.rate + rate_departure[axis] < each.table[axis, RATE_LIMIT]:
                return UnprovedTransition(k, axis, "may exceed the limit of its rate")
            if not accelerations[k][axis] + push[axis] <= each.table[axis, ACCELERATION_LIMIT]:
                return UnprovedTransition(k, axis, "may exceed the limit of its acceleration")
        result.append(replace(each, departure=departure, rate_departure=rate_departure))
    return result


def _entries(
    proved: Sequence[ProvedTransition], start: FloatArray, conditions: AxisConditions, periods: int
) -> list[Entry]:
    """Return the sets in which the axes enter the next transition, reports being used for some periods."""
    if not proved:
        return [Entry(float(x), float(x)) for x in start]
    pairs = zip(proved[-1].table, proved[-1].sets, strict=True)
    return [_widened(next_entry(row, sets, conditions, periods)) for row, sets in pairs]


def _proved(
    k: int, table: FloatArray, entries: Sequence[Entry], conditions: AxisConditions
) -> ProvedTransition | UnprovedTransition:
    """Return the sets of all axes of a transition, and write the condition of rest into its table."""
    every = []
    for axis, (row, entry) in enumerate(zip(table, entries, strict=True)):
        for parts in ENTRY_PARTS:
            sets = axis_sets(row, conditions, entry, parts)
            if sets.distance > 0.0:
                break
        if not sets.distance > 0.0:
            return UnprovedTransition(k, axis, "may leave its funnel")
        if comes_near_limit(row, sets):
            return UnprovedTransition(k, axis, "may come so near the limit of its rate that it is damped")
        reach, rate = sets.settled, sets.settled_rate
        half = (0.5 - EROSION) * (row[GOAL_UPPER] - row[GOAL_LOWER])
        if not (1.0 + SLACK) * reach < half:
            return UnprovedTransition(k, axis, "may never come to rest in its goal interval")
        share = REST_SHARE * (row[GOAL_UPPER] - row[GOAL_LOWER])
        row[REST_REACH] = min(half, max(REST_FACTOR * reach, share))
        row[REST_RATE] = max(REST_FACTOR * rate, REST_SPEED)
        every.append(sets)
    nothing = np.zeros(len(table))
    return ProvedTransition(table, entries, every, nothing, nothing)


def _widened(entry: Entry) -> Entry:
    room, fast = SLACK * (entry.upper - entry.lower), SLACK * (entry.rate_upper - entry.rate_lower)
    return replace(
        entry,
        lower=entry.lower - room,
        upper=entry.upper + room,
        rate_lower=entry.rate_lower - fast,
        rate_upper=entry.rate_upper + fast,
        acceleration=(1.0 + SLACK) * entry.acceleration,
    )
