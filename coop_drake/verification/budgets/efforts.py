"""Check that no robot is told to give more than its actuators can, whatever departs within the budget."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coop_drake.answers.budget import LIMITS, Budget
from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.couplings import effort_shares
from coop_drake.verification.checks import Check

ROUNDING = 1e-9
"""Differences that rounding explains [N, N m]."""


class Asked(NamedTuple):
    """What is asked of the axes in every period of a transition, the last row for ever.

    Attributes:
        accelerations: Largest acceleration that a robot commands, shape (periods + 1, axes).
        rates: Largest nominal rate for which it computes its efforts, shape (periods + 1, axes).
    """

    accelerations: FloatArray
    rates: FloatArray


def asked(budget: Budget, moving: FloatArray, pulls: FloatArray) -> Asked:
    """Return what is asked.

    Args:
        budget: The budget.
        moving: Largest nominal acceleration or command, and rate, in every period, (periods + 1, 2, axes).
        pulls: Largest pull towards the nominal motion, shape (periods + 1, axes).
    """
    later = max(budget.lag - 0.5 * budget.period, 0.0)  # beyond the period whose rates are bounded
    return Asked(moving[:, 0] + pulls, moving[:, 1] + later * moving[:, 0])


def efforts_asked(
    plan: Plan, tree: ComponentTree, every: Sequence[Asked]
) -> tuple[list[FloatArray], FloatArray]:
    """Return the largest efforts that follow in each transition, and their limits, of shape (efforts,) each.

    Args:
        plan: A plan whose budget limits efforts.
        tree: Its team.
        every: What is asked in each transition.

    Raises:
        RefusalError: The plan has no tube.
    """
    budget, tube, efforts = plan.budget, plan.tube, list[FloatArray]()
    assert budget is not None  # checked by the caller
    if tube is None:
        raise RefusalError("tube", "is missing, but the plan has a budget")
    ahead = 0.5 * budget.period + budget.lag
    room = np.array([ahead * float(one.rates.max()) for one in every])
    push, axes, rates = effort_shares(budget, tree, plan.cells, room)
    robots, n = budget.robots, len(tree.joints)
    limits, damping = np.array(budget.effort_limits(n)), np.zeros((2 * robots + n, 1 + n))
    for joint, value in enumerate(budget.dampings):
        damping[2 * robots + joint, 1 + joint] = value
    for k, one in enumerate(every):
        turned = one.accelerations @ axes[k].T + ((one.rates @ rates[k]) * one.rates[None]).sum(axis=2).T
        believed = 1.0 + budget.model_error
        found = believed * (push[k] * tube.acceleration + turned.max(axis=0))
        efforts.append(found + (one.rates @ damping.T).max(axis=0))
    return efforts, limits


def check_stated_efforts(plan: Plan, tree: ComponentTree, every: Sequence[Asked]) -> None:
    """Check that the efforts that transitions state are at least what follows, and at most what is allowed.

    Args:
        plan: A plan whose budget limits efforts.
        tree: Its team.
        every: What is asked in each transition.

    Raises:
        RefusalError: Names the transition and the effort.
    """
    efforts, limits = efforts_asked(plan, tree, every)
    for k, (transition, found) in enumerate(zip(plan.transitions, efforts, strict=True)):
        assert transition.tolerance is not None  # checked by the caller
        stated, where = transition.tolerance.effort, f"transitions[{k}].tolerance.effort"
        if stated.shape != limits.shape:
            raise RefusalError(where, f"has {stated.size} numbers, not {limits.size}")
        for e, value in enumerate(stated):
            if not value >= found[e] - ROUNDING:
                raise RefusalError(f"{where}[{e}]", f"is {value:.6g}; the budget gives up to {found[e]:.6g}")
            if not value <= limits[e]:
                raise RefusalError(f"{where}[{e}]", f"is {value:.6g}; the limit is {limits[e]:.6g}")


def check_efforts(plan: Plan) -> list[Check]:
    """Return the smallest room of the limited efforts; nothing where the budget limits none."""
    budget = plan.budget
    if budget is None or not budget.limited:
        return []
    stated = np.array([one.tolerance.effort for one in plan.transitions if one.tolerance is not None])
    robots, checks = budget.robots, list[Check]()
    parts = stated[:, :robots], stated[:, robots : 2 * robots], stated[:, 2 * robots :]
    units = "N to spare", "N m to spare", "N m or N to spare"
    for name, part, unit in zip(LIMITS, parts, units, strict=True):
        limit = getattr(budget, name)
        if limit is not None and part.size:
            what = f"no {name.replace('_', ' ')} is asked for beyond its limit under the budget"
            checks.append(Check(what, part.size, limit - float(part.max()), unit))
    return checks
