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
from coop_drake.verification.budgets.axis_departure import Loop
from coop_drake.verification.budgets.couplings import effort_shares
from coop_drake.verification.checks import Check

ROUNDING = 1e-9
"""Differences that rounding explains [N, N m]."""


class Asked(NamedTuple):
    """What is asked of the axes in every period of a transition, the last row for ever.

    Attributes:
        accelerations: Largest acceleration that a robot commands, by the true masses, (periods + 1, axes).
        rates: Largest nominal rate for which it computes its efforts, shape (periods + 1, axes).
    """

    accelerations: FloatArray
    rates: FloatArray


class Given(NamedTuple):
    """What acted on the axes before a cell is entered.

    Attributes:
        laws: Largest |L| of the periods before, the latest last, shape (axes, memory).
        others: Largest accelerations besides those that L causes with the factor of a part, shape (p, axes,
            memory).
        most: Largest |L| and largest of the others at all times before, shape (1 + p, axes).
    """

    laws: FloatArray
    others: FloatArray
    most: FloatArray


def nothing_given(loop: Loop, axes: int) -> Given:
    """Return what acted on axes that rest at the plan's start."""
    parts, memory, _ = loop.recent.shape
    error = np.empty((parts, axes, memory))
    error[:] = loop.pushes[:, None]
    return Given(np.zeros((axes, memory)), error, np.concatenate([np.zeros((1, axes)), error[..., 0]]))


def commanded(
    loop: Loop, laws: FloatArray, moving: FloatArray, flows: FloatArray, before: Given, leaving: int
) -> tuple[Asked, Given]:
    """Return what is asked in a transition, and what acts before the next one.

    The true acceleration of an axis is f (L + q) + others behind a lag, f being the middle of a part of the
    model's range. Since the nominal one is L behind the same lag, the departure answers (f - 1) L + others:
    the pull after a unit of L is (f - 1) / f times that after a unit of command. L lies between two known
    numbers in every period, those of the law and of the pull being the same.

    Args:
        loop: The loop of all axes.
        laws: Least and largest L in every period, the last one for ever, shape (periods + 1, 2, axes).
        moving: Largest nominal acceleration and rate, likewise.
        flows: Largest acceleration that enters in every period, shape (p, axes, periods + 1).
        before: What acted before.
        leaving: The first sample at which the cell can be left.
    """
    budget, memory, ever = loop.budget, loop.recent.shape[1], len(laws) - 1
    factors = loop.factors
    others = flows - np.abs(factors - 1.0)[:, None, None] * moving[:, 0].T
    sizes = np.concatenate([np.abs(laws).max(axis=1).T[None], others])
    past = np.concatenate([before.laws[None], before.others])
    sizes = np.concatenate([past, sizes], axis=2)
    last = sizes[..., ever:].max(axis=2)
    most = np.maximum(before.most, sizes.max(axis=2))
    low = np.concatenate([-before.laws, laws[:ever, 0].T], axis=1)
    high = np.concatenate([before.laws, laws[:ever, 1].T], axis=1)
    accelerations = np.zeros((ever + 1, laws.shape[2]))
    alone = (budget.single_noise - 1.0) * loop.direct * (np.arange(laws.shape[2]) == 0)
    for p, factor in enumerate(factors):
        answer = (factor - 1.0) / factor * loop.answers[p]
        old = np.abs(answer[memory:]).sum() * most[0] + loop.old[p, 2] * most[1 + p]
        rest = loop.noise[p, :, 2] + alone + old
        more, less = np.maximum(answer[:memory], 0.0), np.minimum(answer[:memory], 0.0)
        least = laws[:ever, 0] + _after(low, more) + _after(high, less)
        greatest = laws[:ever, 1] + _after(high, more) + _after(low, less)
        pushed = _after(sizes[1 + p, :, :-1], loop.recent[p, ::-1, 2])
        command = np.maximum(-least, greatest) + pushed + rest
        accelerations[:ever] = np.maximum(accelerations[:ever], (factor + loop.spread) * command)
        command = last[0] * (1.0 + np.abs(answer[:memory]).sum()) + rest
        command += last[1 + p] * loop.recent[p, :, 2].sum()
        accelerations[ever] = np.maximum(accelerations[ever], (factor + loop.spread) * command)
    sizes[..., -1] = last
    ends = np.flip(np.maximum.accumulate(np.flip(sizes, 2), axis=2), 2)
    first = min(leaving, ever + 1)
    kept = ends[..., first : first + memory]
    return Asked(accelerations, _ahead(budget, moving)), Given(kept[0], kept[1:], most)


def _after(acted: FloatArray, answer: FloatArray) -> FloatArray:
    """Return the answers in every period to what acted in those before, shape (periods, axes).

    Args:
        acted: In the periods before the transition, and in its own, shape (axes, memory + periods).
        answer: One period later, two, and so on, shape (memory,).
    """
    return np.array([np.convolve(own, answer, "valid")[:-1] for own in acted]).T


def evenly_asked(loop: Loop, moving: tuple[float, float], pull: FloatArray) -> Asked:
    """Return what is asked where axes move with at most an acceleration and a rate, shape (2, axes) each.

    Args:
        loop: The loop of all axes.
        moving: The acceleration and the rate [rad/s^2 or m/s^2, rad/s or m/s].
        pull: Largest pull towards the nominal motion, shape (axes,).
    """
    budget, alone = loop.budget, np.zeros(pull.size)
    alone[0] = (budget.single_noise - 1.0) * loop.direct
    command = (1.0 + budget.model_error) * (moving[0] + pull + alone)
    even = np.tile(np.array(moving)[:, None], (1, 1, pull.size))
    return Asked(command[None], _ahead(budget, even))


def _ahead(budget: Budget, moving: FloatArray) -> FloatArray:
    """Return the largest nominal rates for which efforts are computed, shape (periods, axes)."""
    later = max(budget.lag - 0.5 * budget.period, 0.0)  # beyond the period whose rates are bounded
    rates: FloatArray = moving[:, 1] + later * moving[:, 0]
    return rates


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
        turning = ((one.rates @ rates[k]) * one.rates[None]).sum(axis=2).T
        turned = one.accelerations @ axes[k].T + (1.0 + budget.model_error) * turning + one.rates @ damping.T
        efforts.append(push[k] * tube.acceleration + turned.max(axis=0))
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
