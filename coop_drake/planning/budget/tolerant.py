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
from coop_drake.planning.budget.chain import Limit
from coop_drake.planning.budget.fitting import OVERLAPS, fit_budget, sufficient_overlap
from coop_drake.planning.budget.position_fit import PositionLimit, fit_position
from coop_drake.planning.improvement.quickest import quickest_plan
from coop_drake.progress import Progress

BISECTIONS = 7
"""Halvings of the interval in which the largest budget is sought: it is found within a hundredth."""

SMALLEST = 0.5**BISECTIONS
"""The smallest multiple of a budget that is tried [-]."""


@dataclass(frozen=True)
class BeyondBudget:
    """No plan was found that holds under a budget.

    Attributes:
        limit: What cannot be shown for the plan that bears most, in words.
        budget: The budget that was asked for.
        share: The largest multiple of it under which a plan holds, 0 where none was found.
    """

    limit: str
    budget: Budget
    share: float

    def describe(self) -> str:
        """Return which budget does not hold, what limits it, and the largest scaled budget that holds."""
        said = f"No plan was found that holds under this budget: {self.limit}."
        if self.share == 0.0:
            return f"{said} Nor does one hold under {SMALLEST:.2%} of the budget."
        scaled = self.budget.scaled(self.share).describe()
        return (
            f"{said} The largest share of the budget under which a plan holds is {self.share:.1%}: {scaled}."
        )


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
    tried: list[tuple[Plan, Limit | PositionLimit]] = []
    for overlap in _overlaps(gain_set, budget):
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
        fitted = _fitted(problem, plan, gain_set, budget)
        if isinstance(fitted, Plan):
            return fitted
        tried.append((plan, fitted))
    factors = [_largest_factor(problem, plan, gain_set, budget) for plan, _ in tried]
    best = int(np.argmax(factors))
    plan, limit = tried[best]
    return BeyondBudget(_sentence(plan, limit), budget, factors[best])


def _overlaps(gain_set: ScheduledGains, budget: Budget) -> list[float]:
    """Return the least overlaps of boxes that are tried; the position alone asks for none."""
    if not budget.axes:
        return [0.0]
    least = sufficient_overlap(gain_set, budget)
    return [overlap for overlap in OVERLAPS if overlap >= least]


def _fitted(
    problem: PlanningProblem, plan: Plan, gain_set: ScheduledGains, budget: Budget
) -> Plan | Limit | PositionLimit:
    """Return a plan with gains, sets and regions under which its budget holds; or where it does not."""
    if budget.axes:
        fitted = fit_budget(plan, gain_set, budget)
        if isinstance(fitted, Limit):
            return fitted
        plan = fitted
    return fit_position(problem, plan, gain_set, budget)


def _largest_factor(problem: PlanningProblem, plan: Plan, gain_set: ScheduledGains, budget: Budget) -> float:
    """Return the largest multiple of a budget that holds, at most 1, by bisection; 0 if none was found."""
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if isinstance(_fitted(problem, plan, gain_set, budget.scaled(middle)), Plan):
            low = middle
        else:
            high = middle
    return low


def _sentence(plan: Plan, limit: Limit | PositionLimit) -> str:
    """Say where a budget does not hold, with the names of the robot and of the joint."""
    if isinstance(limit, PositionLimit):
        return limit.reason
    name = "the object's angle"
    if limit.axis > 0:
        robot, _, joint = plan.joint_names[limit.axis - 1].rpartition("/")
        name = f"the joint {joint} of {robot}" if robot else f"the joint {joint}"
    last = len(plan.transitions) - 1
    return f"in transition {limit.transition} of 0 to {last}, {name} {limit.reason}"
