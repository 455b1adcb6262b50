"""Gains with which every axis of a plan stays in its funnels under a budget of departures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from coop_drake.answers.budget import AxisTracking, Budget, Tolerance
from coop_drake.answers.plan import Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.laws import ScheduledGains
from coop_drake.laws.axis_table import LEAVING_TIME, REST_RATE, REST_REACH, axis_table
from coop_drake.laws.gains import IDEAL_AGE, RestCondition
from coop_drake.planning.budget.alarms import axis_noises
from coop_drake.planning.budget.axis_departure import SLACK, AxisLoop, axis_loop, best_loop
from coop_drake.planning.budget.coupling import (
    Couplings,
    Efforts,
    TeamCouplings,
    friction_pushes,
    team_couplings,
)
from coop_drake.planning.budget.restarting import reached_at_restart, with_restart
from coop_drake.planning.budget.transitions import (
    LimitedEfforts,
    ProvedTransition,
    UnprovedTransition,
    follow_transitions,
)
from coop_drake.planning.transitions import share_speeds, with_gains
from coop_drake.tree.pose import FloatArray

AGE_FACTORS = (1.0, 1.25, 1.6, 2.0, 2.3, 2.6, 3.0)
"""Gains are tried for so many times the age of what a nominal motion's commands rest on [-]: slow motions
take smaller accelerations and rates, in which the error of the model has its share."""

ROUNDS = 8
"""Largest number of rates that are tried where ages are wrong or friction is viscous [-]."""

ROOM = 1.05
"""Factor by which the next ones are larger than those that were reached [-]."""

NOTHING = 1e-12
"""Masses and levers below this are none [kg, kg m]."""

_UNSTABLE = UnprovedTransition(0, 0, "is not stable under the delay, the lag and the model's error")


def fit_budget(
    problem: PlanningProblem,
    plan: Plan,
    gain_set: ScheduledGains,
    budget: Budget,
    acceleration: float = 0.0,
    team: TeamCouplings | None = None,
    weight: float = 0.0,
) -> Plan | UnprovedTransition:
    """Choose gains for every transition so that a budget holds, the quickest that do.

    Limits of rates are shared anew among the axes, with room for the departures.

    Args:
        problem: What was asked, with the limits.
        plan: A plan with the gains of the gain set.
        gain_set: The rule of its gains.
        budget: The departures to be tolerated.
        acceleration: Largest acceleration that a robot commands for the object's origin, which counts where
            efforts are limited [m/s^2].
        team: What the masses couple in the plan's cells, computed where it is not given.
        weight: What noise in commands counts where the loop is chosen, see ``best_loop`` [s^2].

    Returns:
        The plan with these gains, the budget and what follows from it, with the times estimated before; or
        where it does not hold. Where efforts are limited it states nothing about rests yet, which depends on
        the position's tube.
    """
    couplings, efforts = team or team_couplings(budget, problem.tree, plan.cells)
    pushes = friction_pushes(budget, couplings, 0.0) if budget.rubs else np.zeros(0)
    if not np.isfinite(pushes).all():
        return UnprovedTransition(0, None, "cells are too wide to bound what friction of joints accelerates")
    loop = best_loop(budget, tuple(pushes.tolist()), weight)
    if loop is None:
        return _UNSTABLE
    factors = _factors(gain_set, budget)
    plans = [with_gains(plan, gain_set.slowed(factors[0]), plan.gain_set)]
    if problem.limits.any:
        plans = [share_speeds(problem, plans[0], gain_set.slowed(factors[0]), loop.typical()[1])]

    def table_of(choice: int, k: int) -> FloatArray:
        while len(plans) <= choice:
            plans.append(with_gains(plans[0], gain_set.slowed(factors[len(plans)]), plan.gain_set))
        return axis_table(plans[choice].funnel(k), plans[choice].transitions[k].gains)

    limited = None if efforts is None else LimitedEfforts(efforts, acceleration)
    for _ in range(ROUNDS if budget.clock_error or budget.joint_viscous else 1):
        found = follow_transitions(
            table_of, len(factors), couplings.rates[:, 1:], plan.start[2:], loop, limited
        )
        if isinstance(found, UnprovedTransition):
            return found
        faster = _faster(found, loop, couplings)
        if faster is None:
            break
        loop = replace(loop, tracking=faster)
    else:
        return UnprovedTransition(0, None, "an axis may be too fast for wrong clocks or viscous friction")
    fitted = tuple(
        _stated(plans[passed.choice].transitions[k], passed, factors[passed.choice], loop)
        for k, passed in enumerate(found)
    )
    fitted_plan = replace(plans[0], transitions=fitted, budget=budget, axis_tracking=loop.tracking)
    return fitted_plan if limited else with_restart(fitted_plan, loop, couplings.rates[:, 1:], None)


def acceleration_left(plan: Plan, efforts: Efforts, acceleration: float) -> float:
    """Return the largest acceleration of the object's origin for which limits of efforts leave room [m/s^2].

    Args:
        plan: A plan of ``fit_budget``.
        efforts: What efforts accelerations take in its cells.
        acceleration: The acceleration for which it states efforts [m/s^2].
    """
    stated = np.array([one.tolerance.effort for one in plan.transitions if one.tolerance is not None])
    left = (efforts.limits - stated) / np.maximum((1.0 + SLACK) * efforts.push, NOTHING)
    return acceleration + float(left.min())


def with_acceleration(plan: Plan, team: TeamCouplings, before: float) -> Plan:
    """Return a plan that states efforts for the acceleration of its tube, and from which rests it holds.

    Args:
        plan: A plan of ``fit_budget`` with a tube.
        team: What its masses couple in its cells.
        before: The acceleration for which it states efforts [m/s^2].
    """
    (couplings, efforts), tube, tracking, budget = team, plan.tube, plan.axis_tracking, plan.budget
    assert efforts is not None  # the budget limits some
    assert tube is not None
    assert tracking is not None
    assert budget is not None
    transitions = []
    for one, push in zip(plan.transitions, efforts.push, strict=True):
        assert one.tolerance is not None  # of a plan with a budget
        effort = one.tolerance.effort + (1.0 + SLACK) * (tube.acceleration - before) * push
        transitions.append(replace(one, tolerance=replace(one.tolerance, effort=effort)))
    loop, limited = axis_loop(tracking, budget), LimitedEfforts(efforts, tube.acceleration)
    assert loop is not None  # the plan's axes were fitted with it
    stated = replace(plan, transitions=tuple(transitions))
    return with_restart(stated, loop, couplings.rates[:, 1:], limited)


def _faster(found: Sequence[ProvedTransition], loop: AxisLoop, couplings: Couplings) -> AxisTracking | None:
    """Return larger rates and accelerations of axes that wrong ages and viscous friction shall count with.

    None if they are not larger. Departures grow with them, and they with departures. Those of beginning a
    cell anew are among them.
    """
    budget = loop.budget
    if not (budget.clock_error or budget.joint_viscous):
        return None
    reached, known = np.max([one.reached for one in found], axis=0), np.zeros((2, len(found[0].sets)))
    reached = np.maximum(reached, reached_at_restart(loop, couplings.rates[:, 1:]))
    if loop.tracking.rate:
        known[:] = loop.tracking.rate, loop.tracking.acceleration
    if (reached <= known).all():
        return None
    rate, acceleration = np.maximum(ROOM * reached, known)
    pushes = friction_pushes(budget, couplings, rate).tolist() if budget.rubs else ()
    numbers = tuple(rate.tolist()), tuple(acceleration.tolist()), tuple(pushes)
    return replace(loop.tracking, rate=numbers[0], acceleration=numbers[1], disturbance=numbers[2])


def _factors(gain_set: ScheduledGains, budget: Budget) -> list[float]:
    """Return ages of commands over that of the gain set: neither noise nor delay reaches a nominal motion."""
    age = max(IDEAL_AGE, 0.5 * budget.period + budget.lag)
    return [age / gain_set.age * factor for factor in AGE_FACTORS]


def _stated(transition: Transition, passed: ProvedTransition, factor: float, loop: AxisLoop) -> Transition:
    """Return a transition with what it states: its condition of rest, and the sets of its axes."""
    table = passed.table
    rest = RestCondition(
        float(table[0, LEAVING_TIME]), table[:, REST_REACH].copy(), table[:, REST_RATE].copy()
    )
    gains = replace(transition.gains, rest=rest)
    return replace(transition, gains=gains, tolerance=_tolerance(factor, passed, loop))


def _tolerance(factor: float, passed: ProvedTransition, loop: AxisLoop) -> Tolerance:
    entries, every = passed.entries, passed.sets
    noise, rate_noise = axis_noises(loop.budget, loop.tracking, len(every))
    return Tolerance(
        age_factor=factor,
        entry_lower=np.array([entry.lower for entry in entries]),
        entry_upper=np.array([entry.upper for entry in entries]),
        entry_rate_lower=np.array([entry.rate_lower for entry in entries]),
        entry_rate_upper=np.array([entry.rate_upper for entry in entries]),
        entry_acceleration=np.array([entry.acceleration for entry in entries]),
        distance=passed.spare,
        acceleration=np.array([(1.0 + SLACK) * sets.acceleration for sets in every]),
        settled=np.array([(1.0 + SLACK) * sets.settled for sets in every]),
        settled_rate=np.array([(1.0 + SLACK) * sets.settled_rate for sets in every]),
        departure=passed.departure,
        rate_departure=passed.rate_departure,
        alarm=passed.departure + noise,
        rate_alarm=passed.rate_departure + rate_noise,
        effort=passed.effort,
        entry_parts=tuple(sets.parts for sets in every),
    )
