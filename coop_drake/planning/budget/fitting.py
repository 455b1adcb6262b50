"""Gains with which every axis of a plan stays in its funnels under a budget of departures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coop_drake.answers.budget import Budget, Tolerance
from coop_drake.answers.plan import Plan, Transition
from coop_drake.laws import ScheduledGains, transition_gains
from coop_drake.laws.axis_table import ENERGY_BOUND, axis_table
from coop_drake.planning.budget.axis_sets import (
    AxisSets,
    Entry,
    axis_sets,
    becomes_ready,
    conditions_of,
    needed_energy,
    next_entry,
    whole_periods,
)
from coop_drake.planning.budget.axis_tube import AxisConditions
from coop_drake.planning.execution.estimate import timed
from coop_drake.tree.pose import FloatArray

AGE_FACTORS = (1.0, 1.5, 2.2)
"""Gains are tried for so many times the age of the gain set's commands [-]: slow ones bear more delay, quick
ones more noise and larger forces."""

ENTRY_FACTOR = 1.2
"""A stricter condition of entry than the gain set's: V below so many times what a settled axis needs [-]."""

ENTRY_PARTS = (1, 4)
"""Parts into which the positions at an entry are cut, tried in this order [-]."""

SLACK = 1e-3
"""Fraction by which stated bounds are wider than computed ones [-]: more than another way to round needs."""

BISECTIONS = 7
"""Halvings of the interval in which the largest budget is sought: it is found within a hundredth."""


@dataclass(frozen=True)
class Limit:
    """Where a budget does not hold.

    Attributes:
        transition: Index of the transition.
        axis: Index of the axis, theta being 0.
        reason: What cannot be shown, in words.
    """

    transition: int
    axis: int
    reason: str

    def describe(self, plan: Plan) -> str:
        """The limit in words, with the name of the axis."""
        name = "the object's angle" if self.axis == 0 else f"joint {plan.joint_names[self.axis - 1]}"
        return f"in transition {self.transition} {name} {self.reason}"


@dataclass(frozen=True)
class _Fitted:
    """A transition with gains that fit, its table, and the sets of its axes."""

    transition: Transition
    table: FloatArray
    entries: Sequence[Entry]
    sets: tuple[AxisSets, ...]


def fit_budget(plan: Plan, gain_set: ScheduledGains, budget: Budget) -> Plan | Limit:
    """Choose gains for every transition so that a budget holds, the quickest that do.

    Args:
        plan: A plan with the gains of the gain set.
        gain_set: The rule of its gains.
        budget: The departures to be tolerated.

    Returns:
        The plan with these gains, the budget and what follows from it; or where it does not hold.
    """
    age = (whole_periods(budget.delay, budget.period) + 0.5) * budget.period + budget.lag
    least, first = max(1.0, age / gain_set.age), None
    for factor in AGE_FACTORS:
        found = _fit_all(plan, gain_set, budget, least * factor)
        if isinstance(found, Plan):
            return found
        first = first or found
    assert first is not None  # there is a factor
    return first


def _fit_all(plan: Plan, gain_set: ScheduledGains, budget: Budget, factor: float) -> Plan | Limit:
    """Fit every transition, with gains for a multiple of the age, the same for all so that K falls slowly."""
    conditions = conditions_of(budget)
    before: _Fitted | None = None
    fitted: list[Transition] = []
    for k in range(len(plan.transitions)):
        found = _fit(plan, k, gain_set, budget, conditions, before, factor)
        if isinstance(found, Limit):
            return found
        before = found
        fitted.append(found.transition)
    return timed(replace(plan, transitions=tuple(fitted), budget=budget))


def largest_factor(plan: Plan, gain_set: ScheduledGains, budget: Budget) -> float:
    """Return the largest multiple of a budget that holds, at most 1, by bisection; 0 if none was found."""
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if isinstance(fit_budget(plan, gain_set, budget.scaled(middle)), Limit):
            high = middle
        else:
            low = middle
    return low


def _fit(
    plan: Plan,
    k: int,
    gain_set: ScheduledGains,
    budget: Budget,
    conditions: Sequence[AxisConditions],
    before: _Fitted | None,
    factor: float,
) -> _Fitted | Limit:
    limits: list[Limit] = []
    for strict in (False, True) if before is not None else (False,):
        transition, table = _with_gains(plan, k, gain_set, factor)
        entries = []
        for axis, row in enumerate(table):
            if before is None:
                entries.append(Entry(float(plan.start[2 + axis]), float(plan.start[2 + axis])))
                continue
            old, sets = before.table[axis], before.sets[axis]
            needed = ENTRY_FACTOR * needed_energy(old, sets, row, conditions[0])
            row[ENERGY_BOUND] = needed if strict else max(row[ENERGY_BOUND], needed)
            periods = whole_periods(budget.report_age, budget.period)
            entries.append(_widened(next_entry(old, sets, before.entries[axis], row, conditions[0], periods)))
        found = _all_sets(table, conditions, entries, k)
        if not isinstance(found, Limit):
            gains = replace(transition.gains, energy_bound=table[:, ENERGY_BOUND].copy())
            tolerance = _stated(factor, entries, found)
            return _Fitted(replace(transition, gains=gains, tolerance=tolerance), table, entries, found)
        limits.append(found)
    return limits[0]


def _with_gains(plan: Plan, k: int, gain_set: ScheduledGains, factor: float) -> tuple[Transition, FloatArray]:
    """Return a transition with the gains for a multiple of the age, and its table."""
    cell, transition = plan.cells[k], plan.transitions[k]
    resting = plan.start[2:]
    if k > 0:
        resting = 0.5 * (plan.transitions[k - 1].goal_lower + plan.transitions[k - 1].goal_upper)
    gains = transition_gains(
        replace(gain_set, command_age=factor * gain_set.age),
        clearance=transition.neck,
        slice_lower=cell.lower,
        slice_upper=cell.upper,
        goal_lower=transition.goal_lower,
        goal_upper=transition.goal_upper,
        resting=resting,
    )
    transition = replace(transition, gains=gains)
    transitions = (*plan.transitions[:k], transition, *plan.transitions[k + 1 :])
    return transition, axis_table(replace(plan, transitions=transitions).funnel(k), gains)


def _all_sets(
    table: FloatArray, conditions: Sequence[AxisConditions], entries: Sequence[Entry], k: int
) -> tuple[AxisSets, ...] | Limit:
    every = []
    for axis, (row, entry) in enumerate(zip(table, entries, strict=True)):
        for parts in ENTRY_PARTS:
            sets = axis_sets(row, conditions, entry, parts)
            if sets.distance > 0.0:
                break
        if not sets.distance > 0.0:
            return Limit(k, axis, "may leave its funnel")
        if not becomes_ready(row, sets, conditions[0]):
            return Limit(k, axis, "may never count as arrived in its goal interval")
        every.append(sets)
    return tuple(every)


def _widened(entry: Entry) -> Entry:
    room, fast = SLACK * (entry.upper - entry.lower), SLACK * (entry.rate_upper - entry.rate_lower)
    return Entry(
        entry.lower - room,
        entry.upper + room,
        entry.rate_lower - fast,
        entry.rate_upper + fast,
        (1.0 + SLACK) * entry.acceleration,
        (1.0 + SLACK) * entry.history,
    )


def _stated(factor: float, entries: Sequence[Entry], every: Sequence[AxisSets]) -> Tolerance:
    return Tolerance(
        age_factor=factor,
        entry_lower=np.array([entry.lower for entry in entries]),
        entry_upper=np.array([entry.upper for entry in entries]),
        entry_rate_lower=np.array([entry.rate_lower for entry in entries]),
        entry_rate_upper=np.array([entry.rate_upper for entry in entries]),
        entry_acceleration=np.array([entry.acceleration for entry in entries]),
        entry_history=np.array([entry.history for entry in entries]),
        distance=np.array([(1.0 - SLACK) * sets.distance for sets in every]),
        acceleration=np.array([(1.0 + SLACK) * sets.acceleration for sets in every]),
        settled=np.array([(1.0 + SLACK) * sets.settled for sets in every]),
        entry_parts=tuple(sets.parts for sets in every),
    )
