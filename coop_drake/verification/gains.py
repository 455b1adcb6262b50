"""Check the gains that a plan states, by computing them again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import sqrt

import numpy as np

from coop_drake.answers.belonging import other_age
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet, ScheduledGains, TransitionGains, transition_gains
from coop_drake.laws.gain_schedule import schedule_of
from coop_drake.laws.gains import IDEAL_AGE, RestCondition
from coop_drake.verification.checks import Check

RELATIVE = 1e-9
"""Relative difference of figures that are computed twice, in another order of operations [-]."""

SAME_PLACE = 1e-9
"""Paths shorter than this do not move the position, only angles [m]."""


def check_gains(plan: Plan, gain_sets: Mapping[str, GainSet]) -> Check:
    """Compute the gains of every transition again; all that is geometry belongs to the exact checker.

    Limits are taken as they are stated; ``check_speeds`` and ``check_accelerations`` check them. So are the
    distances and rates of the condition of rest, which ``check_budget`` checks, and K of a plan with a tube.

    Args:
        plan: The plan.
        gain_sets: The scenario's gain sets by name.

    Raises:
        RefusalError: Names the transition, the figure and what it should be.
    """
    if plan.gain_set not in gain_sets:
        raise RefusalError("gain_set", f"{plan.gain_set!r} is none of {', '.join(sorted(gain_sets))}")
    if other := other_age(plan, gain_sets[plan.gain_set]):
        raise RefusalError("transitions[0].gains.rate_gain", other)
    check_ages(plan, gain_sets[plan.gain_set])
    resting = plan.start[2:]
    for k, transition in enumerate(plan.transitions):
        where = f"transitions[{k}]"
        if transition.only_angles != (transition.length <= SAME_PLACE):
            raise RefusalError(f"{where}.only_angles", f"{transition.only_angles} over {transition.length} m")
        gain_set, tolerance = gain_sets[plan.gain_set], transition.tolerance
        if isinstance(gain_set, ScheduledGains):
            factor = plan.age_factor * (1.0 if tolerance is None else tolerance.age_factor)
            gain_set = gain_set.slowed(factor)
        gains = transition_gains(
            gain_set,
            clearance=transition.neck,
            slice_lower=plan.cells[k].lower,
            slice_upper=plan.cells[k].upper,
            goal_lower=transition.goal_lower,
            goal_upper=transition.goal_upper,
            resting=resting,
            speed_limit=transition.gains.speed_limit,
            rate_limit=transition.gains.rate_limit,
            acceleration_limit=transition.gains.acceleration_limit,
        )
        if tolerance is not None:
            gains = replace(gains, rest=_rest(transition.gains.rest, gains.hand_over_time, where))
        if plan.tube is not None:
            gains = _with_one_stiffness(plan, gains, gain_sets[plan.gain_set], transition.gains.stiffness)
        _compare(transition.gains, gains, f"{where}.gains")
        resting = 0.5 * (transition.goal_lower + transition.goal_upper)
    return Check("gains are those that the gain set gives for the cells", len(plan.transitions))


def check_ages(plan: Plan, gain_set: GainSet) -> None:
    """Refuse gains for commands that are younger than the team's.

    Nominal motions of axes rest on no measurement: their commands are as old as half a period and the lag.

    Raises:
        RefusalError: Names the factor.
    """
    if not isinstance(gain_set, ScheduledGains):
        ages = {"age_factor": plan.age_factor}
        ages |= {
            f"transitions[{k}].tolerance.age_factor": one.tolerance.age_factor
            for k, one in enumerate(plan.transitions)
            if one.tolerance is not None
        }
        for where, factor in ages.items():
            if factor != 1.0:
                raise RefusalError(where, f"is {factor}; fixed gains are for no age, so that it is 1")
        return
    if not plan.age_factor >= 1.0:
        finding = f"is {plan.age_factor}: the gains are for commands that are younger than the team's"
        raise RefusalError("age_factor", finding)
    for k, transition in enumerate(plan.transitions):
        if transition.tolerance is None or plan.budget is None:
            continue
        least = max(IDEAL_AGE, 0.5 * plan.budget.period + plan.budget.lag)
        age = plan.age_factor * transition.tolerance.age_factor * gain_set.age
        if not age >= least * (1.0 - RELATIVE):
            finding = (
                f"gives gains for commands {age:.6g} s old; those of nominal motions are {least:.6g} s old"
            )
            raise RefusalError(f"transitions[{k}].tolerance.age_factor", finding)


def _rest(stated: RestCondition | None, after: float, where: str) -> RestCondition | None:
    """Return the stated condition of rest; its distances and rates are checked with the budget's sets."""
    if stated is not None and stated.after != after:
        raise RefusalError(f"{where}.gains.rest.after", f"is {stated.after} s; the hand-over takes {after} s")
    return stated


def _with_one_stiffness(
    plan: Plan, gains: TransitionGains, gain_set: GainSet, stiffness: float
) -> TransitionGains:
    """Return the gains with the K that a plan with a tube has in all cells, and what follows from it.

    K may be any number up to the largest one of the gain set in any cell: the tube is checked for it.
    """
    if not isinstance(gain_set, ScheduledGains):
        return gains
    factors = [1.0 if one.tolerance is None else one.tolerance.age_factor for one in plan.transitions]
    largest = schedule_of(gain_set.slowed(plan.age_factor * min(factors))).max_stiffness
    if not stiffness <= largest * (1.0 + RELATIVE):
        finding = f"is {stiffness:.6g}; the largest one of the gain set is {largest:.6g}"
        raise RefusalError("transitions[0].gains.stiffness", finding)
    root = sqrt(stiffness)
    return gains.with_governor(stiffness, gain_set.damping_factor * root, gain_set.governor_factor * root)


def _compare(found: TransitionGains, expected: TransitionGains, where: str) -> None:
    for name, value in vars(expected).items():
        stated = getattr(found, name)
        same = value is None or stated is None or isinstance(value, str | RestCondition)
        if not (stated == value if same else np.allclose(stated, value, rtol=RELATIVE, atol=0.0)):
            raise RefusalError(f"{where}.{name}", f"is {stated}; the cell gives {value}")
