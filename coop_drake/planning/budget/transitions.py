"""The sets of all axes from transition to transition: from one entry set follows the next one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from coop_drake.answers.budget import Budget
from coop_drake.laws.axis_table import GOAL_LOWER, GOAL_UPPER, LEAVING_TIME, REST_RATE, REST_REACH
from coop_drake.laws.readiness import EROSION
from coop_drake.laws.sampling import whole_periods
from coop_drake.planning.budget.axis_sets import AxisSets, Entry, axis_sets, conditions_of
from coop_drake.planning.budget.axis_tube import AxisConditions
from coop_drake.planning.budget.leaving import next_entry, rest_needed, settling_time
from coop_drake.planning.budget.rate_room import comes_near_limit
from coop_drake.tree.pose import FloatArray

REST_FACTOR = 1.5
"""Departure from rest with which a cell may be left, over the largest one of a settled axis [-]. A larger
factor leaves the cell earlier, but makes the entry set of the next cell larger."""

QUICK_RATE = 0.2
"""Rate below which a cell may be left at first, anywhere in the eroded goal interval, if that is larger
[rad/s or m/s]: most transitions hold with it, and waiting for less costs time."""

STRICTEST = 2
"""Largest ``ProvedTransition.strictness``: the number of the last condition under which a cell may be left
[-]."""

ENTRY_PARTS = (1, 3)
"""Parts into which the positions at an entry are cut, tried in this order [-]."""

SLACK = 1e-3
"""Fraction by which stated bounds are wider than computed ones [-]: more than another way to round needs."""


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
        entries: The sets in which they enter.
        sets: What follows.
        strictness: 0 if axes may leave the cell at ``QUICK_RATE``, 1 if not, 2 if they must have settled.
    """

    table: FloatArray
    entries: Sequence[Entry]
    sets: Sequence[AxisSets]
    strictness: int = 0


def follow_transitions(
    tables: Sequence[FloatArray], start: FloatArray, budget: Budget
) -> list[ProvedTransition] | UnprovedTransition:
    """Follow all axes under a budget through transitions.

    Where a transition does not hold, the condition under which the cell before it is left becomes stricter.

    Args:
        tables: The axes in every transition, each an ``axis_table`` with quintic funnels.
        start: Where they rest at the beginning, shape (axes,) [rad or m].
        budget: The departures to be tolerated.
    """
    conditions, proved = conditions_of(budget), list[ProvedTransition]()
    while len(proved) < len(tables):
        k = len(proved)
        found = _proved(k, tables[k].copy(), _entries(proved, start, budget, conditions[0]), conditions)
        if isinstance(found, ProvedTransition):
            proved.append(found)
        elif not proved or proved[-1].strictness == STRICTEST:
            return found
        else:
            proved[-1] = _stricter(proved[-1], conditions[0])
    return proved


def _entries(
    proved: Sequence[ProvedTransition], start: FloatArray, budget: Budget, conditions: AxisConditions
) -> list[Entry]:
    """Return the sets in which the axes enter the next transition."""
    if not proved:
        return [Entry(float(x), float(x)) for x in start]
    before, periods = proved[-1], whole_periods(budget.report_age, budget.period)
    return [
        _widened(next_entry(row, sets, entry, conditions, periods))
        for row, sets, entry in zip(before.table, before.sets, before.entries, strict=True)
    ]


def _stricter(passed: ProvedTransition, conditions: AxisConditions) -> ProvedTransition:
    """Return a transition whose cell is left under the next stricter condition."""
    table, strictness = passed.table.copy(), passed.strictness + 1
    for row, sets in zip(table, passed.sets, strict=True):
        reach, rate = rest_needed(sets, conditions)
        row[REST_REACH], row[REST_RATE] = min(REST_FACTOR * reach, row[REST_REACH]), REST_FACTOR * rate
    if strictness == STRICTEST:
        times = [settling_time(row, sets, conditions) for row, sets in zip(table, passed.sets, strict=True)]
        table[:, LEAVING_TIME] = max(*times, float(table[0, LEAVING_TIME]))
    return replace(passed, table=table, strictness=strictness)


def _proved(
    k: int, table: FloatArray, entries: Sequence[Entry], conditions: Sequence[AxisConditions]
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
        if comes_near_limit(row, sets, conditions, entry):
            return UnprovedTransition(k, axis, "may come so near the limit of its rate that it is damped")
        reach, rate = rest_needed(sets, conditions[0])
        half = (0.5 - EROSION) * (row[GOAL_UPPER] - row[GOAL_LOWER])
        if not (1.0 + SLACK) * reach < half:
            return UnprovedTransition(k, axis, "may never come to rest in its goal interval")
        row[REST_REACH], row[REST_RATE] = half, max(REST_FACTOR * rate, QUICK_RATE)
        every.append(sets)
    return ProvedTransition(table, entries, every)


def _widened(entry: Entry) -> Entry:
    room, fast = SLACK * (entry.upper - entry.lower), SLACK * (entry.rate_upper - entry.rate_lower)
    return replace(
        entry,
        lower=entry.lower - room,
        upper=entry.upper + room,
        rate_lower=entry.rate_lower - fast,
        rate_upper=entry.rate_upper + fast,
        acceleration=(1.0 + SLACK) * entry.acceleration,
        history=(1.0 + SLACK) * entry.history,
    )
