"""Gains with which every axis of a plan stays in its funnels under a budget of departures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf

import numpy as np

from coop_drake.answers.budget import AxisTracking, Budget, Restart, Tolerance
from coop_drake.answers.plan import Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.laws import ScheduledGains
from coop_drake.laws.actuators import ACCELERATION, RATE
from coop_drake.laws.axis_table import (
    ACCELERATION_LIMIT,
    GOAL_LOWER,
    GOAL_UPPER,
    LEAVING_TIME,
    RATE_LIMIT,
    REST_RATE,
    REST_REACH,
    axis_table,
)
from coop_drake.laws.gains import IDEAL_AGE, RestCondition
from coop_drake.laws.measurements import whole_periods
from coop_drake.laws.readiness import EROSION, RATE_TOLERANCE
from coop_drake.planning.transitions import share_speeds, with_gains
from coop_drake.robustness.alarms import (
    AxisRoom,
    axis_room,
    leaving_since,
    may_miss,
    of_stage,
    rate_noises,
    room_at_entry,
)
from coop_drake.robustness.axis_departure import (
    HORIZON,
    PULL,
    SLACK,
    AxisLoop,
    Departures,
    Inflow,
    at_rest,
    axis_loop,
    departing,
    moving_evenly,
    resting_axes,
)
from coop_drake.robustness.couplings import (
    QUICKEST,
    Couplings,
    Efforts,
    TeamCouplings,
    friction_pushes,
    team_couplings,
)
from coop_drake.robustness.efforts import (
    CommandInflow,
    LimitedEfforts,
    even_efforts,
    nothing_commanded,
    single_noise,
    transition_efforts,
)
from coop_drake.robustness.leaving import first_leaving, next_entry
from coop_drake.robustness.nominal_axes import (
    AxisConditions,
    AxisSets,
    Entry,
    axis_sets,
    comes_near_limit,
)
from coop_drake.tree.pose import FloatArray

# All axes from transition to transition: from one entry set of a nominal motion follows the next one.

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
        room -= may_miss(budget, levels)
        first.append(begin)
        every.append(levels)
        begin = low
    if room.min() < 0.0:
        return int(room.argmin())
    leave = [
        may_miss(budget, one) for one, end in zip(every, [*first[1:], samples], strict=True) if end > since
    ]
    return AxisAlarms(first, np.array(every), np.max(leave, axis=0))


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
    first, levels = np.array(passed.alarms.first), passed.alarms.levels
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


# How far axes depart where a team begins a cell anew from rest, see ``answers/restart.py``. On the slow way
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
