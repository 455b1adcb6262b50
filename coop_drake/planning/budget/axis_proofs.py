"""Follows the axes of a plan through transitions: from one entry set of nominal motions follows the next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from coop_drake.answers.budget import Budget
from coop_drake.laws.axis_table import (
    ACCELERATION_LIMIT,
    GOAL_LOWER,
    GOAL_UPPER,
    RATE_LIMIT,
    REST_RATE,
    REST_REACH,
)
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.readiness import EROSION
from coop_drake.robustness.alarms import (
    AxisRoom,
    axis_room,
    leaving_since,
    may_miss,
    of_stage,
    room_at_entry,
)
from coop_drake.robustness.axis_departure import (
    SLACK,
    AxisLoop,
    Departures,
    Inflow,
    at_rest,
    departing,
)
from coop_drake.robustness.couplings import QUICKEST
from coop_drake.robustness.efforts import (
    CommandInflow,
    LimitedEfforts,
    nothing_commanded,
    transition_efforts,
)
from coop_drake.robustness.nominal_axes import (
    AxisConditions,
    AxisSets,
    Entry,
    axis_sets,
    comes_near_limit,
    first_leaving,
    next_entry,
)
from coop_drake.tree.arrays import FloatArray

REST_SHARE = 0.05
"""Largest distance from the middle of a goal interval with which a nominal motion may leave a cell, over the
interval's width [-]: the less, the smaller is the entry set of the next cell, and the longer it takes."""

REST_SPEED = 0.03
"""Largest rate with which a nominal motion may leave a cell [rad/s or m/s]."""

REST_FACTOR = 1.5
"""Least distance and rate with which a cell may be left, over the largest ones of a settled motion [-]."""

ATTEMPTS = 12
"""Largest number of attempts to get beyond a transition, with other gains of it or of those before it [-]."""

OTHERWISE = 0.01
"""Fraction by which departures are enlarged [-]: numbers that machines round otherwise give sets that differ
by far less."""

ENTRY_PARTS = (1, 3)
"""Parts into which the positions at an entry are cut, tried in this order [-]."""


@dataclass(frozen=True)
class UnprovedTransition:
    """The first transition for which a budget cannot be shown to hold.

    Attributes:
        transition: Index of the transition.
        axis: Index of the axis, theta being 0; None where the reason names an effort.
        reason: What cannot be shown, in words.
    """

    transition: int
    axis: int | None
    reason: str


@dataclass(frozen=True)
class AxisAlarms:
    """The levels of monitors of axes in one transition.

    Attributes:
        first: First samples of the stages.
        levels: Of |e| and |e + t e'| in every stage, shape (stages, 2, axes) [rad or m].
        missed: How far off axes may be when the cell is left, while no report tells of it, shape (axes,) [rad
            or m].
    """

    first: list[int]
    levels: FloatArray
    missed: FloatArray


@dataclass(frozen=True)
class ProvedTransition:
    """One transition for which a budget holds.

    Attributes:
        table: Its axes, an ``axis_table`` with the condition of rest under which the cell is left.
        entries: The sets in which their nominal motions enter.
        sets: What follows for these.
        spare: Least distances of the axes to their funnels' bounds, shape (axes,) [rad or m].
        departure: Largest departures from them, shape (axes,) [rad or m].
        rate_departure: Largest departures of the rates, shape (axes,) [rad/s or m/s].
        alarms: The levels of monitors.
        reached: Largest rates and accelerations of the axes, departures included, shape (2, axes).
        effort: Largest efforts, as a ``Tolerance`` states them.
        inflow: What has entered the loops of its axes when the next one begins.
        commanded: What has been commanded then; None where nothing limits efforts.
        choice: Number of the gains that it has.
    """

    table: FloatArray
    entries: Sequence[Entry]
    sets: Sequence[AxisSets]
    spare: FloatArray
    departure: FloatArray
    rate_departure: FloatArray
    alarms: AxisAlarms
    reached: FloatArray
    effort: FloatArray
    inflow: Inflow
    commanded: CommandInflow | None = None
    choice: int = 0


def follow_transitions(
    table_of: Callable[[int, int], FloatArray],
    choices: int,
    couplings: FloatArray,
    start: FloatArray,
    loop: AxisLoop,
    limited: LimitedEfforts | None = None,
) -> list[ProvedTransition] | UnprovedTransition:
    """Follow all axes through transitions: their nominal motions, and how far they depart from these.

    Every transition has the first gains with which it holds, and with which the next one does.

    Args:
        table_of: Returns the axes in transition k with a choice of gains, an ``axis_table`` with quintic
            funnels.
        choices: How many choices of gains there are, the quickest first.
        couplings: How much rates accelerate the axes in every cell, see ``cell_couplings``.
        start: Where they rest at the beginning, shape (axes,) [rad or m].
        loop: The loop that pulls the axes to their nominal motions, with the budget.
        limited: What limits efforts, None where nothing does.
    """
    proved, choice, furthest, failed = list[ProvedTransition](), 0, -1, 0
    limit = UnprovedTransition(0, 0, "")
    while (k := len(proved)) < len(couplings):
        found = _attempt(
            k, table_of(choice, k).copy(), couplings[k], proved[-1] if proved else start, loop, limited
        )
        if not isinstance(found, UnprovedTransition):
            proved.append(replace(found, choice=choice))
            choice = 0
            continue
        if k > furthest:
            furthest, failed, limit = k, 0, found
        choice, failed = choice + 1, failed + 1
        while choice == choices or failed == ATTEMPTS:
            if failed == ATTEMPTS or not proved:
                return limit
            choice = proved.pop().choice + 1
    return proved


def _attempt(
    k: int,
    table: FloatArray,
    coupling: FloatArray,
    before: ProvedTransition | FloatArray,
    loop: AxisLoop,
    limited: LimitedEfforts | None,
) -> ProvedTransition | UnprovedTransition:
    """Return what is proved of transition k, entered from the one before or from rest, or what is not."""
    budget, T = loop.budget, loop.budget.period
    conditions = AxisConditions(T, budget.lag)
    if isinstance(before, ProvedTransition):
        entries, inflow = _entries(before, conditions, whole_periods(budget.report_age, T)), before.inflow
    else:
        entries, inflow = [Entry(float(x), float(x)) for x in before], at_rest(loop, len(before))
    every = _sets(k, table, entries, conditions)
    if isinstance(every, UnprovedTransition):
        return every
    leaving = first_leaving(table, every, T)
    found, following = departing(loop, every, coupling, inflow, leaving)
    found = Departures(*((1.0 + OTHERWISE) * one for one in found))
    departure, rate_departure, push = (one.max(axis=0) for one in found[:3])
    spare = np.array([(1.0 - SLACK) * sets.spare(found.position[:, i]) for i, sets in enumerate(every)])
    if not (spare > 0.0).all():
        return UnprovedTransition(k, int(spare.argmin()), "may leave its funnel")
    seen = axis_room(budget, loop.tracking, every, found, inflow)
    seen = seen._replace(room=(1.0 - SLACK) * seen.room)
    missed = before.alarms.missed if isinstance(before, ProvedTransition) else 0.0 * spare
    alarms = _alarms(seen, budget, leaving, missed)
    if isinstance(alarms, int):
        return UnprovedTransition(k, alarms, "may leave its funnel before its monitor sees it")
    if leaving_since(budget, leaving) == 0:  # what the cell before has missed may still be unknown
        alarms = replace(alarms, missed=np.maximum(alarms.missed, missed))
    reached = np.empty((2, len(every)))
    for axis, sets in enumerate(every):
        reached[0, axis] = (1.0 + SLACK) * sets.fastest(found.rate[:, axis], T)
        reached[1, axis] = (1.0 + SLACK) * sets.acceleration + push[axis]
        if not reached[0, axis] < table[axis, RATE_LIMIT]:
            return UnprovedTransition(k, axis, "may exceed the limit of its rate")
        if not reached[1, axis] <= table[axis, ACCELERATION_LIMIT]:
            return UnprovedTransition(k, axis, "may exceed the limit of its acceleration")
    effort, commanded = np.zeros(0), None
    if limited is not None:
        commanded = before.commanded if isinstance(before, ProvedTransition) else None
        commanded = commanded or nothing_commanded(loop, len(every))
        effort, rates, commanded = transition_efforts(
            k, limited, every, found, loop, commanded, leaving, OTHERWISE
        )
        if rates.max() > QUICKEST:
            return UnprovedTransition(k, int(rates.argmax()), "may turn too fast to bound efforts")
        of, effort = limited.efforts, (1.0 + SLACK) * effort
        if not (effort <= of.limits).all():
            worst = int((effort / of.limits).argmax())
            most = f"{effort[worst]:.0f}, more than its {of.limits[worst]:.0f}"
            return UnprovedTransition(k, None, f"{of.names[worst]} may be told to give {most}")
    return ProvedTransition(
        table, entries, every, spare, departure, rate_departure, alarms, reached, effort, following, commanded
    )


def _alarms(seen: AxisRoom, budget: Budget, leaving: int, missed: FloatArray) -> AxisAlarms | int:
    """Return the levels of monitors in as few stages as leave room; or the first axis that has too little.

    A stage begins where reports begin that may be used when the cell is left, so that the next one need not
    have room for what departs earlier.

    Args:
        seen: What monitors see and may miss.
        budget: The budget.
        leaving: The first sample at which the cell can be left.
        missed: How far off axes may be that a monitor in the cell before has missed, shape (axes,).
    """
    samples, since, first, every = len(seen.room), leaving_since(budget, leaving), list[int](), []
    begin, room = 0, room_at_entry(seen, budget) - missed
    while begin < samples and room.min() >= 0.0:
        low, high = begin + 1, since if begin < since else samples
        while low < high:  # by bisection the last sample at which it may end
            middle = (low + high + 1) // 2
            levels, room = of_stage(seen, budget, begin, middle)
            low, high = (middle, high) if (may_miss(budget, levels) <= room).all() else (low, middle - 1)
        levels, room = of_stage(seen, budget, begin, low)
        room -= may_miss(budget, levels).max(axis=0)
        first.append(begin)
        every.append(levels)
        begin = low
    if room.min() < 0.0:
        return int(room.argmin())
    leave = [
        may_miss(budget, one) for one, end in zip(every, [*first[1:], samples], strict=True) if end > since
    ]
    return AxisAlarms(first, np.array(every), np.max(leave, axis=(0, 1)))


def _entries(before: ProvedTransition, conditions: AxisConditions, periods: int) -> list[Entry]:
    """Return the sets in which the axes enter the next transition, reports being used for some periods."""
    pairs = zip(before.table, before.sets, strict=True)
    return [_widened(next_entry(row, sets, conditions, periods)) for row, sets in pairs]


def _sets(
    k: int, table: FloatArray, entries: Sequence[Entry], conditions: AxisConditions
) -> list[AxisSets] | UnprovedTransition:
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
    return every


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
