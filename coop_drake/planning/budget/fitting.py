"""Gains with which every axis of a plan stays in its funnels under a budget of departures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from math import inf

import numpy as np

from coop_drake.answers.budget import AxisTracking, Budget, Restart, Tolerance
from coop_drake.answers.plan import Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.laws import ScheduledGains
from coop_drake.laws.actuators import ACCELERATION, RATE
from coop_drake.laws.axis_table import (
    LEAVING_TIME,
    REST_RATE,
    REST_REACH,
    axis_table,
)
from coop_drake.laws.gains import IDEAL_AGE, RestCondition
from coop_drake.laws.readiness import RATE_TOLERANCE
from coop_drake.planning.budget.axis_proofs import (
    OTHERWISE,
    ProvedTransition,
    UnprovedTransition,
    follow_transitions,
)
from coop_drake.planning.transitions import share_speeds, with_gains
from coop_drake.robustness.alarms import rate_noises
from coop_drake.robustness.axis_departure import (
    HORIZON,
    PULL,
    SLACK,
    AxisLoop,
    axis_loop,
    moving_evenly,
    resting_axes,
)
from coop_drake.robustness.couplings import (
    Couplings,
    Efforts,
    TeamCouplings,
    friction_pushes,
    team_couplings,
)
from coop_drake.robustness.efforts import (
    LimitedEfforts,
    even_efforts,
    single_noise,
)
from coop_drake.tree.arrays import FloatArray

STIFFNESSES = (100.0, 150.0, 200.0, 250.0, 300.0, 400.0, 500.0, 700.0, 1000.0)
"""K_a that are tried [1/s^2]; the narrowest tube is taken."""


DAMPINGS = (1.2, 1.4, 1.7, 2.0, 2.5)
"""zeta_a over the root of K_a that are tried [-]."""


RATE_WEIGHT = 0.01
"""What a departure of the rate counts beside one of the axis, where gains are chosen [s]: it takes its part
of the limit of the rate."""


COMMAND_WEIGHTS = (0.0005, 0.004)
"""What noise in a command counts beside a departure of the axis, where efforts are limited [s^2]: for stiff
loops, as an axis with little room needs them, and for soft ones, which take small efforts."""

SLOWER = (1.0, 0.5, 0.25, 0.1)
"""Shares of the usual rate and acceleration that are tried one after the other [-]."""

CHOICES = (
    tuple((older, 1.0) for older in (1.0, 1.25, 1.6, 2.0, 2.3, 2.6, 3.0)),
    ((3.0, 0.5), (4.0, 0.5), (5.0, 0.5), (6.0, 0.5), (8.0, 0.5)),
    ((4.0, 0.5), (5.0, 0.5), (6.0, 0.5), (8.0, 0.5), (8.0, 0.35), (11.0, 0.35), (11.0, 0.25)),
)
"""Gains are tried for so many times the age of what a nominal motion's commands rest on, and for such a share
of the limits of rates [-]: slow motions take smaller accelerations and rates, in which the error of the model
has its share. The age slows down how an axis moves to the middle of its funnel, the share its bounds. Lists
are tried in turn where rates are limited: limits are shared among the axes for the first gains of a list."""

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
    for choices in CHOICES if problem.limits.any else CHOICES[:1]:
        fitted = _fit_gains(problem, plan, gain_set, loop, couplings, efforts, acceleration, choices)
        if isinstance(fitted, Plan):
            break
    return fitted


def _fit_gains(
    problem: PlanningProblem,
    plan: Plan,
    gain_set: ScheduledGains,
    loop: AxisLoop,
    couplings: Couplings,
    efforts: Efforts | None,
    acceleration: float,
    choices: Sequence[tuple[float, float]],
) -> Plan | UnprovedTransition:
    """Choose gains for every transition among some, the quickest that do; otherwise as ``fit_budget``.

    Args:
        problem: What was asked, with the limits.
        plan: A plan with the gains of the gain set.
        gain_set: The rule of its gains.
        loop: The loop that pulls the axes to their nominal motions, with the budget.
        couplings: What the masses couple in the plan's cells.
        efforts: What efforts accelerations take there, None where no effort is limited.
        acceleration: Largest acceleration that a robot commands for the object's origin [m/s^2].
        choices: Ages of commands and shares of limits of rates, see ``CHOICES``.
    """
    budget = loop.budget
    # Neither noise nor delay reaches a nominal motion.
    factor = max(IDEAL_AGE, 0.5 * budget.period + budget.lag) / gain_set.age

    def with_choice(plan: Plan, choice: int) -> Plan:
        older, share = choices[choice]
        return with_gains(plan, gain_set.slowed(factor * older), plan.gain_set, rate_share=share)

    plans = [with_choice(plan, 0)]
    if problem.limits.any:
        older, share = choices[0]
        shared = share_speeds(problem, plans[0], gain_set.slowed(factor * older), loop.typical()[1])
        plans = [shared if share == 1.0 else with_choice(shared, 0)]

    def table_of(choice: int, k: int) -> FloatArray:
        while len(plans) <= choice:
            plans.append(with_choice(plans[0], len(plans)))
        return axis_table(plans[choice].funnel(k), plans[choice].transitions[k].gains)

    limited = None if efforts is None else LimitedEfforts(efforts, acceleration)
    for _ in range(ROUNDS if budget.clock_error or budget.joint_viscous else 1):
        found = follow_transitions(
            table_of, len(choices), couplings.rates[:, 1:], plan.start[2:], loop, limited
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
        _stated(plans[passed.choice].transitions[k], passed, factor, choices[passed.choice], loop)
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


def _stated(
    transition: Transition,
    passed: ProvedTransition,
    factor: float,
    choice: tuple[float, float],
    loop: AxisLoop,
) -> Transition:
    """Return a transition with what it states: its condition of rest, and the sets of its axes."""
    table = passed.table
    rest = RestCondition(
        float(table[0, LEAVING_TIME]), table[:, REST_REACH].copy(), table[:, REST_RATE].copy()
    )
    gains, (older, share) = replace(transition.gains, rest=rest), choice
    if gains.rate_limit is None or not np.isfinite(gains.rate_limit).any():
        share = 1.0  # a share of no limit is none
    return replace(transition, gains=gains, tolerance=_tolerance(factor * older, share, passed, loop))


def _tolerance(age_factor: float, rate_share: float, passed: ProvedTransition, loop: AxisLoop) -> Tolerance:
    entries, every = passed.entries, passed.sets
    first, levels = np.array(passed.alarms.first), passed.alarms.levels
    return Tolerance(
        age_factor=age_factor,
        rate_share=rate_share,
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
        alarm_times=loop.budget.period * np.maximum(first - 0.5, 0.0),
        alarm=tuple(levels[:, 0]),
        ahead_alarm=tuple(levels[:, 1]),
        rate_alarm=passed.rate_departure + rate_noises(loop.budget, loop.tracking, len(every)),
        effort=passed.effort,
        entry_parts=tuple(sets.parts for sets in every),
    )


@lru_cache(maxsize=8)
def best_loop(budget: Budget, disturbance: tuple[float, ...] = (), weight: float = 0.0) -> AxisLoop | None:
    """Return the loop with the gains for which a typical axis departs least; None where none is stable.

    Args:
        budget: The budget.
        disturbance: As that of ``AxisTracking``.
        weight: What noise in a command counts beside a departure, see ``COMMAND_WEIGHTS`` [s^2].
    """
    best, least = None, inf
    for stiffness in STIFFNESSES:
        for damping in DAMPINGS:
            tracking = AxisTracking(stiffness, damping * stiffness**0.5, disturbance=disturbance)
            loop = axis_loop(tracking, budget)
            if loop is None:
                continue
            away, fast = loop.typical()
            found = away + RATE_WEIGHT * fast + weight * float(loop.noises(1)[:, :, PULL].max())
            if found < least:
                best, least = loop, found
    return best


# How far axes depart where a team begins a cell anew from rest, see ``answers/budget.py``. On the slow way
# of ``laws/actuators.py`` every axis has at most a rate and an acceleration that are the same in all cells.
# The departures follow as in a transition, from a rest with constant errors: before it and at all samples
# that are still to be used, what was measured is where the nominal motion is. An axis that is taken for
# resting may have a small rate still: what this causes is added, by superposition.


def with_restart(plan: Plan, loop: AxisLoop, couplings: FloatArray, limited: LimitedEfforts | None) -> Plan:
    """Return a plan that states from which rests its cells can be begun anew.

    Args:
        plan: The plan with its budget and the gains of its axes.
        loop: The loop that pulls the axes to their nominal motions.
        couplings: How much rates accelerate the axes in every cell.
        limited: What limits efforts, None where nothing does.

    Returns:
        The plan; without such a statement where limits allow no motion of the usual kind.
    """
    every = [transition.gains for transition in plan.transitions]
    counted = loop.tracking.rate or None, loop.tracking.acceleration or None  # with which wrong ages count
    resting = resting_axes(loop, RATE_TOLERANCE)
    for share in SLOWER:
        rate, acceleration = share * RATE, share * ACCELERATION
        found = [moving_evenly(loop, coupling, (acceleration, rate)) for coupling in couplings]
        within = [
            (fastest is None or (rate + one.rate + resting[1] < fastest).all())
            and (most is None or (acceleration + one.acceleration + resting[2] < most).all())
            for one, limits in zip(found, every, strict=True)
            for fastest, most in ((limits.rate_limit, limits.acceleration_limit), counted)
        ]
        pulls = np.array([one.pull + resting[2] + single_noise(loop, len(one.pull)) for one in found])
        if limited is not None:
            efforts = (1.0 + SLACK) * even_efforts(limited, loop.budget, (rate, acceleration), pulls)
            within += [bool((efforts <= limited.efforts.limits).all())]
        if all(within):
            departures = tuple((1.0 + OTHERWISE) * (one.position + resting[0]) for one in found)
            return replace(plan, restart=Restart(rate, acceleration, RATE_TOLERANCE, HORIZON, departures))
    return plan


def reached_at_restart(loop: AxisLoop, couplings: FloatArray) -> FloatArray:
    """Return the largest rates and accelerations of axes on the usual slow way, shape (2, axes)."""
    _, fast, push, _ = resting_axes(loop, RATE_TOLERANCE)
    every = [moving_evenly(loop, coupling, (ACCELERATION, RATE)) for coupling in couplings]
    reached = np.array([[RATE + one.rate + fast, ACCELERATION + one.acceleration + push] for one in every])
    most: FloatArray = (1.0 + OTHERWISE) * reached.max(axis=0)
    return most
