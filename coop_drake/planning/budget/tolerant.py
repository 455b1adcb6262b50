"""A plan that holds under a budget: boxes with wider overlaps and slower gains are tried until it does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely.errors import ShapelyError

from coop_drake.answers.budget import Budget
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, PlanError, StallError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.boxes.channel import Channel, CoveredPath
from coop_drake.planning.budget.fitting import Limit, fit_budget, largest_factor
from coop_drake.planning.improvement.quickest import quickest_plan
from coop_drake.progress import Progress

OVERLAPS = (0.0, 0.06, 0.12, 0.2)
"""Least overlaps of consecutive boxes that are tried, in every angle and joint [rad or m]: the wider the goal
intervals, the larger are the departures that an axis bears in them, and the more cells a plan has."""


@dataclass(frozen=True)
class BeyondBudget:
    """No plan was found that holds under a budget.

    Attributes:
        limit: What cannot be shown for the plan that bears most, in words.
        budget: The largest multiple of the budget under which a plan holds, None where none does.
    """

    limit: str
    budget: Budget | None

    def describe(self) -> str:
        """Return which budget does not hold, what limits it, and the largest scaled budget that holds."""
        if self.budget is None:
            return f"not with this budget, nor with a hundredth of it: {self.limit}"
        return f"not with this budget: {self.limit}; with this one: {self.budget.describe()}"


def tolerant_plan(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: ScheduledGains,
    *,
    gain_set_name: str,
    budget: Budget,
    progress: Progress | None = None,
) -> Plan | BeyondBudget:
    """Make a plan along a path that a search found, with boxes and gains for which a budget holds.

    Args:
        problem: What was asked.
        found: What the search found.
        gain_set: The rule of the gains.
        gain_set_name: Name under which the scenario knows it.
        budget: The departures to be tolerated.
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        GeometryError: As ``quickest_plan``, and so are the others.
        PlanError: No plan can be made.
        StallError: No plan can be executed.
    """
    tried: list[tuple[Plan, Limit]] = []
    for overlap in OVERLAPS:
        try:
            plan = quickest_plan(
                problem,
                found,
                gain_set,
                gain_set_name=gain_set_name,
                least_overlap=overlap,
                progress=progress,
            )
        except (GeometryError, PlanError, StallError, ShapelyError):
            if not tried:
                raise
            continue
        fitted = fit_budget(plan, gain_set, budget)
        if isinstance(fitted, Plan):
            return fitted
        tried.append((plan, fitted))
    return _beyond(tried, gain_set, budget)


def _beyond(tried: list[tuple[Plan, Limit]], gain_set: ScheduledGains, budget: Budget) -> BeyondBudget:
    factors = [largest_factor(plan, gain_set, budget) for plan, _ in tried]
    best = int(np.argmax(factors))
    plan, limit = tried[best]
    return BeyondBudget(limit.describe(plan), budget.scaled(factors[best]) if factors[best] > 0.0 else None)
