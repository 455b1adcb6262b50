"""Check from which rests a plan says that its cells can be begun anew.

On the slow way after a rest no axis has a larger nominal rate or acceleration than stated, and none leaves
its slice, if it begins inside by the stated departure. Once the way is over and the stated time has passed,
nothing of it is left in the loops of the axes: what holds for the cell that was entered from the one before
holds again.
"""

from __future__ import annotations

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.errors import RefusalError
from coop_drake.tree import ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.budgets.axis_departure import HORIZON, Loop, departures, loop_of, resting
from coop_drake.verification.budgets.couplings import couplings
from coop_drake.verification.budgets.efforts import Asked, efforts_asked, evenly_asked
from coop_drake.verification.budgets.position import of_origin
from coop_drake.verification.budgets.position_loop import may_rest
from coop_drake.verification.checks import Check

RESTING = 0.02
"""Rate that is not yet taken for motion, as the mean over a tenth of a second [rad/s or m/s]."""

ROUNDING = 1e-9
"""Differences that rounding explains [rad or m]."""


def check_restart(plan: Plan, tree: ComponentTree) -> Check | None:
    """Check what a plan states about beginning a cell anew; None where it states nothing.

    Args:
        plan: The plan, whose budget has been checked.
        tree: Its team.

    Raises:
        RefusalError: Names the entry.
    """
    stated, axes, budget = plan.restart, plan.start.size - 2, plan.budget
    if stated is None:
        return None
    if budget is None or not budget.axes or plan.axis_tracking is None:
        raise RefusalError("restart", "is stated, but the plan has no budget for the axes")
    gains = plan.transitions[0].gains
    pushed = of_origin(budget, plan.axis_tracking)
    if plan.tube is None or not may_rest(plan.tube, gains.stiffness, gains.damping, pushed, stated.rest_rate):
        raise RefusalError("restart.rest_rate", "the object's tube does not hold from rests with such a rate")
    tracking, terms = plan.axis_tracking, np.zeros((len(plan.cells), axes, axes, axes))
    loop = loop_of(tracking, budget)
    if budget.bodies:
        terms = couplings(budget, tree, plan.cells).rates[:, 1:]
    if stated.rest_rate < RESTING:
        raise RefusalError(
            "restart.rest_rate", f"{stated.rest_rate:g} is below {RESTING:g}, taken for resting"
        )
    if stated.wait < HORIZON:
        raise RefusalError(
            "restart.wait", f"{stated.wait:g} s is shorter than the {HORIZON:g} s of a response"
        )
    if len(stated.departures) != len(plan.cells):
        raise RefusalError(
            "restart.departures", f"has {len(stated.departures)} rows for {len(plan.cells)} cells"
        )
    started, memory = _started(loop, stated.rest_rate), loop.recent.shape[1]
    moving = np.tile([[stated.acceleration], [stated.rate]], (memory + 1, 1, axes))
    least, every = np.inf, list[Asked]()
    for k, (cell, own) in enumerate(zip(plan.cells, stated.departures, strict=True)):
        found, _, _ = departures(loop, terms[k], moving, resting(loop, axes), memory)
        away, fast, push, pull = found.max(axis=0) + started[:, None]
        every.append(evenly_asked(loop, (stated.acceleration, stated.rate), pull))
        if own.shape != (axes,) or not (own >= away - ROUNDING).all():
            raise RefusalError(f"restart.departures[{k}]", f"the budget gives up to {away.max():.6g}")
        most = plan.transitions[k].gains.rate_limit
        if most is not None and not (stated.rate + fast <= most).all():
            raise RefusalError("restart.rate", f"in cell {k} an axis may be faster than its limit")
        most = plan.transitions[k].gains.acceleration_limit
        if most is not None and not (stated.acceleration + push <= most).all():
            raise RefusalError("restart.acceleration", f"in cell {k} an axis may exceed its limit")
        if tracking.rate and not (stated.rate + fast <= tracking.rate).all():
            raise RefusalError(
                "restart.rate", f"in cell {k} an axis may be faster than wrong ages count with"
            )
        if tracking.acceleration and not (stated.acceleration + push <= tracking.acceleration).all():
            raise RefusalError("restart.acceleration", f"in cell {k} wrong ages count with less")
        least = min(least, float((0.5 * (cell.upper - cell.lower) - own).min()))
    efforts, limits = efforts_asked(plan, tree, every) if budget.limited else ([], np.zeros(0))
    if not all((one <= limits).all() for one in efforts):
        raise RefusalError("restart.acceleration", "a robot may be told to give more than its limits allow")
    return Check(
        "cells can be begun anew from rests inside them under the budget", len(plan.cells), least,
        "rad or m to the ends of slices from their middle",
    )  # fmt: skip


def _started(loop: Loop, rate: float) -> FloatArray:
    """Return |e|, |e'|, |e''| and |q| at most because of a rate at the beginning, shape (4,)."""
    T, total = loop.budget.period, loop.recent.sum(axis=1) + loop.old
    pull = rate * loop.started[:, 2] / (1.0 - loop.spread * total[:, 2])
    push = (1.0 + loop.budget.model_error) * pull
    away = rate * loop.started[:, 0] + loop.spread * pull * total[:, 0] + T * T / 8.0 * push
    fast = rate * loop.started[:, 1] + loop.spread * pull * total[:, 1] + T * push
    return np.array([away.max(), fast.max(), push.max(), pull.max()])
