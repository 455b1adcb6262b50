"""Check the gains that a plan states, by computing them again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from coop_drake.answers.belonging import other_age
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.laws import GainSet, ScheduledGains, TransitionGains, transition_gains
from coop_drake.laws.gains import RestCondition
from coop_drake.verification.checks import Check

RELATIVE = 1e-9
"""Relative difference of figures that are computed twice, in another order of operations [-]."""

SAME_PLACE = 1e-9
"""Paths shorter than this do not move the position, only angles [m]."""


def check_gains(plan: Plan, gain_sets: Mapping[str, GainSet]) -> Check:
    """Compute the gains of every transition again; all that is geometry belongs to the exact checker.

    Limits are taken as they are stated; ``check_speeds`` and ``check_accelerations`` check them.

    The estimated time comes of a simulation and does not matter for safety: it is the only figure that
    nothing but the digest of the file protects.

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
        if tolerance is not None:  # the condition of rest follows from the budget
            gains = replace(gains, rest=transition.gains.rest)
        if plan.tube is not None:  # K of a plan with a tube is part of what follows from its budget
            own = transition.gains
            gains = gains.with_governor(own.stiffness, own.damping, own.governor_gain)
        _compare(transition.gains, gains, f"{where}.gains")
        resting = 0.5 * (transition.goal_lower + transition.goal_upper)
    return Check("gains are those that the gain set gives for the cells", len(plan.transitions))


def _compare(found: TransitionGains, expected: TransitionGains, where: str) -> None:
    for name, value in vars(expected).items():
        stated = getattr(found, name)
        same = value is None or isinstance(value, str | RestCondition)
        if not (stated == value if same else np.allclose(stated, value, rtol=RELATIVE, atol=0.0)):
            raise RefusalError(f"{where}.{name}", f"is {stated}; the cell gives {value}")
