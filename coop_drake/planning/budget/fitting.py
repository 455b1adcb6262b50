"""Gains with which every axis of a plan stays in its funnels under a budget of departures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from coop_drake.answers.budget import Budget, Tolerance
from coop_drake.answers.plan import Plan, Transition
from coop_drake.laws import Funnel, ScheduledGains, transition_gains
from coop_drake.laws.axis_table import LEAVING_TIME, REST_RATE, REST_REACH, axis_table
from coop_drake.laws.gains import RestCondition
from coop_drake.laws.sampling import whole_periods
from coop_drake.planning.budget.axis_sets import AxisSets, Entry
from coop_drake.planning.budget.transitions import (
    SLACK,
    ProvedTransition,
    UnprovedTransition,
    follow_transitions,
)
from coop_drake.planning.execution.estimate import timed
from coop_drake.tree.pose import FloatArray

AGE_FACTORS = (1.0, 1.5)
"""Gains are tried for so many times the age of the gain set's commands [-]. Slow gains tolerate more delay,
quick ones larger disturbances. One factor for all transitions keeps K from changing much between cells."""

OVERLAPS = (0.02, 0.04, 0.06, 0.09, 0.12)
"""Least overlaps of consecutive boxes to choose from, in every angle and joint [rad or m]: the wider the goal
intervals, the larger are the departures that an axis bears in them, and the more cells a plan has."""

TYPICAL = (1.0, 1.5, 4.0)
"""Widths of typical slices over those of their goal intervals [-], from axes that only keep their place to
axes that move far."""


def fit_budget(plan: Plan, gain_set: ScheduledGains, budget: Budget) -> Plan | UnprovedTransition:
    """Choose gains for every transition so that a budget holds, the quickest that do.

    Args:
        plan: A plan with the gains of the gain set.
        gain_set: The rule of its gains.
        budget: The departures to be tolerated.

    Returns:
        The plan with these gains, the budget and what follows from it; or where it does not hold.
    """
    first = None
    for factor in _factors(gain_set, budget):
        transitions = _with_gains(plan, gain_set.slowed(factor))
        again = replace(plan, transitions=transitions)
        tables = [axis_table(again.funnel(k), one.gains) for k, one in enumerate(transitions)]
        proved = follow_transitions(tables, plan.start[2:], budget)
        if not isinstance(proved, UnprovedTransition):
            fitted = tuple(_stated(*pair, factor) for pair in zip(transitions, proved, strict=True))
            return timed(replace(plan, transitions=fitted, budget=budget))
        first = first or proved
    assert first is not None  # there is a factor
    return first


def sufficient_overlap(gain_set: ScheduledGains, budget: Budget) -> float:
    """Return the least overlap with which a budget holds for typical axes, the largest if it does for none.

    Such an axis moves from the beginning of its slice to its end, back, and to its end again.
    """
    for overlap in OVERLAPS:
        for factor in _factors(gain_set, budget):
            gains = gain_set.slowed(factor)
            forth, back = (_typical(gains, overlap, way) for way in (False, True))
            start = np.full(len(TYPICAL), 0.5 * overlap)
            if not isinstance(follow_transitions([forth, back, forth], start, budget), UnprovedTransition):
                return overlap
    return OVERLAPS[-1]


def _typical(gain_set: ScheduledGains, overlap: float, back: bool) -> FloatArray:
    """Return the table of axes that move from one end of their slices to the other, goals being this wide."""
    width = overlap * np.array(TYPICAL)
    ends = np.zeros_like(width), width - overlap
    first, last = ends[::-1] if back else ends
    gains = transition_gains(
        gain_set,
        clearance=1.0,
        slice_lower=np.zeros_like(width),
        slice_upper=width,
        goal_lower=last,
        goal_upper=last + overlap,
        resting=first + 0.5 * overlap,
    )
    funnel = Funnel(np.zeros_like(width), width, last, last + overlap, gains.decay_rate, gains.funnel)
    return axis_table(funnel, gains)


def _factors(gain_set: ScheduledGains, budget: Budget) -> list[float]:
    age = (whole_periods(budget.delay, budget.period) + 0.5) * budget.period + budget.lag
    return [max(1.0, age / gain_set.age) * factor for factor in AGE_FACTORS]


def _with_gains(plan: Plan, gain_set: ScheduledGains) -> tuple[Transition, ...]:
    """Return all transitions with the gains of another rule."""
    resting, transitions = plan.start[2:], []
    for cell, transition in zip(plan.cells, plan.transitions, strict=True):
        gains = transition_gains(
            gain_set,
            clearance=transition.neck,
            slice_lower=cell.lower,
            slice_upper=cell.upper,
            goal_lower=transition.goal_lower,
            goal_upper=transition.goal_upper,
            resting=resting,
            speed_limit=transition.gains.speed_limit,
            rate_limit=transition.gains.rate_limit,
            acceleration_limit=transition.gains.acceleration_limit,
        )
        transitions.append(replace(transition, gains=gains))
        resting = 0.5 * (transition.goal_lower + transition.goal_upper)
    return tuple(transitions)


def _stated(transition: Transition, passed: ProvedTransition, factor: float) -> Transition:
    """Return a transition with what it states: its condition of rest, and the sets of its axes."""
    table = passed.table
    rest = RestCondition(
        float(table[0, LEAVING_TIME]), table[:, REST_REACH].copy(), table[:, REST_RATE].copy()
    )
    gains = replace(transition.gains, rest=rest)
    return replace(transition, gains=gains, tolerance=_tolerance(factor, passed.entries, passed.sets))


def _tolerance(factor: float, entries: Sequence[Entry], every: Sequence[AxisSets]) -> Tolerance:
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
        settled_rate=np.array([(1.0 + SLACK) * sets.settled_rate for sets in every]),
        entry_parts=tuple(sets.parts for sets in every),
    )
