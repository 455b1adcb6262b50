"""A plan that holds under a budget: boxes with wider overlaps and slower gains are tried until it does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain

from shapely.errors import ShapelyError

from coop_drake.answers.budget import AxisTracking, Budget
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, PlanError, StallError
from coop_drake.laws import ScheduledGains
from coop_drake.planning.budget.axis_proofs import UnprovedTransition
from coop_drake.planning.budget.fitting import (
    COMMAND_WEIGHTS,
    acceleration_left,
    fit_budget,
    with_acceleration,
)
from coop_drake.planning.budget.position_fit import (
    UnprovedPosition,
    commanded_accelerations,
    fit_position,
    unproved_position,
)
from coop_drake.planning.cell_selection import quickest_plan
from coop_drake.planning.channel import Channel, CoveredPath
from coop_drake.planning.duration import plan_time
from coop_drake.progress import Progress
from coop_drake.robustness.alarms import rubbed
from coop_drake.robustness.couplings import QUICKEST, TeamCouplings, friction_pushes, team_couplings
from coop_drake.robustness.position import position_may_rest

SHARE_STEP = 0.01
"""The largest share of a budget is found within this [-]."""

ROUNDED = 1.001
"""Factor by which shares may differ from ``SHARE_STEP`` because they are rounded [-]."""

OVERLAPS = (0.04, 0.06, 0.09, 0.02)
"""Least overlaps of consecutive boxes that are tried, in every angle and joint [rad or m]: the wider the goal
intervals, the larger are the departures that an axis bears in them, and the more cells a plan has. The last
one is for passages that leave no room for wider ones."""

_Tried = tuple[Plan, UnprovedTransition | UnprovedPosition]
"""A plan, and why a budget does not hold for it."""


@dataclass(frozen=True)
class BeyondBudget:
    """No plan was found that holds under a budget.

    Attributes:
        limit: What cannot be shown, just above ``share``, for the plan that bears most, in words.
        budget: The budget that was asked for.
        share: The largest share of it under which a plan holds, 0 where none was found.
    """

    limit: str
    budget: Budget
    share: float

    def describe(self) -> str:
        """Return the largest share of the budget that holds, and what limits it, in full sentences."""
        said = "No plan was found that holds under this budget."
        if self.share == 0.0:
            return f"{said} Even under {SHARE_STEP:.0%} of it, {self.limit}."
        scaled = self.budget.scaled(self.share).describe()
        return f"{said} One holds under at most {self.share:.0%} of it: {scaled}. Under more, {self.limit}."


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
        GeometryError: As ``quickest_plan`` raises it; so are the others.
        PlanError: No plan can be made.
        StallError: No plan can be executed.
    """
    tried: list[_Tried] = []
    plans = _plans(problem, found, gain_set, gain_set_name, budget, progress)
    for plan in plans:
        fitted = _fitted(problem, plan, gain_set, budget, team_couplings(budget, problem.tree, plan.cells))
        if isinstance(fitted, Plan):
            return fitted
        tried.append((plan, fitted))
        if _is_final(fitted):
            break
    return _beyond(problem, tried, plans, gain_set, budget)


def _plans(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: ScheduledGains,
    gain_set_name: str,
    budget: Budget,
    progress: Progress | None,
) -> Iterator[Plan]:
    """Make a plan for every least overlap with which one can be made; the first one must be."""
    count = 0
    for overlap in OVERLAPS if budget.axes else (0.0,):  # the position alone asks for none
        try:
            plan = quickest_plan(
                problem, found, gain_set, gain_set_name=gain_set_name, least_overlap=overlap,
                progress=progress,
            )  # fmt: skip
        except (GeometryError, PlanError, StallError, ShapelyError):
            if count == 0:
                raise
            continue
        count += 1
        yield plan


def _is_final(unproved: UnprovedTransition | UnprovedPosition) -> bool:
    """Whether other cells would not help."""
    return isinstance(unproved, UnprovedPosition) and unproved.whatever_cells


def _narrowest_goal(plan: Plan) -> float:
    """Return the width of a plan's narrowest goal interval [rad or m]."""
    return min(
        float((one.goal_upper - one.goal_lower).min()) for one in plan.transitions[:-1] or plan.transitions
    )


def _beyond(
    problem: PlanningProblem,
    tried: list[_Tried],
    others: Iterator[Plan],
    gain_set: ScheduledGains,
    budget: Budget,
) -> BeyondBudget:
    """Find the largest share of the budget that holds for one of the plans, by bisection.

    Args:
        problem: What was asked.
        tried: Plans under which the budget does not hold, and why.
        others: Further plans; they are made only where cells limit the share.
        gain_set: The rule of the gains.
        budget: The budget.
    """
    best, said = 0.0, ""
    widest_first = sorted(tried, key=lambda one: -_narrowest_goal(one[0]))  # these bear most
    for plan, unproved in chain(widest_first, ((plan, tried[0][1]) for plan in others)):
        team = team_couplings(budget, problem.tree, plan.cells)
        low, high, share = best, 1.0, best + SHARE_STEP  # mostly cells that bear no more fail there
        while high - low > ROUNDED * SHARE_STEP:
            found = _fitted(problem, plan, gain_set, budget.scaled(share), team)
            if isinstance(found, Plan):
                low = share
            else:
                high, unproved = share, found
            share = 0.5 * (low + high)
        if low > best or not said:
            best, said = low, _sentence(plan, unproved)
        if _is_final(unproved):
            break
    return BeyondBudget(said, budget, best)


def _fitted(
    problem: PlanningProblem, plan: Plan, gain_set: ScheduledGains, budget: Budget, team: TeamCouplings
) -> Plan | UnprovedTransition | UnprovedPosition:
    """Return what ``_held`` does; a plan states nothing about rests from which its position is not held."""
    found = _held(problem, plan, gain_set, budget, team)
    if isinstance(found, Plan) and found.restart is not None and found.tube is not None:
        governor, pushed = found.transitions[0].gains, rubbed(budget, found.axis_tracking)
        speeds = governor.stiffness, governor.damping
        if not position_may_rest(found.tube, speeds, pushed, found.restart.rest_rate):
            return replace(found, restart=None)
    return found


def _held(
    problem: PlanningProblem, plan: Plan, gain_set: ScheduledGains, budget: Budget, team: TeamCouplings
) -> Plan | UnprovedTransition | UnprovedPosition:
    """Return a plan with gains, sets and regions under which its budget holds; or where it does not."""
    resting = _rubbed(budget, team, 0.0)
    unproved = unproved_position(problem, plan, gain_set, resting)  # first, for it takes far less time
    if unproved is not None:
        return unproved
    if not budget.axes:
        return fit_position(problem, plan, gain_set, budget)
    if budget.limited:
        return _within_limits(problem, plan, gain_set, budget, team)
    fitted = fit_budget(problem, plan, gain_set, budget, team=team)
    if isinstance(fitted, UnprovedTransition):
        return fitted
    return fit_position(problem, fitted, gain_set, budget)


def _within_limits(
    problem: PlanningProblem, plan: Plan, gain_set: ScheduledGains, budget: Budget, team: TeamCouplings
) -> Plan | UnprovedTransition | UnprovedPosition:
    """Return the quickest plan whose efforts stay within their limits; or what does not hold.

    The axes take what they need beside the least that the position takes of an effort, and the position
    takes what they leave. Then more is kept for the position, as long as the plan gets quicker by it.
    """
    efforts = team.efforts
    assert efforts is not None  # the budget limits some
    best: tuple[Plan, float] | None = None
    failed: UnprovedTransition | UnprovedPosition | None = None
    accelerations = commanded_accelerations(problem, plan, gain_set, _rubbed(budget, team, QUICKEST))
    for weight in COMMAND_WEIGHTS:
        left = 0.0
        for kept in reversed(accelerations):
            if kept <= left:
                continue
            found = fit_budget(problem, plan, gain_set, budget, kept, team, weight)
            if isinstance(found, UnprovedTransition):
                failed = failed or found
                break
            left = acceleration_left(found, efforts, kept)
            placed = fit_position(problem, found, gain_set, budget, left)
            if isinstance(placed, UnprovedPosition):
                failed = failed or placed
            elif best is None or plan_time(placed) < plan_time(best[0]):
                best = placed, kept
            else:
                break
    if best is not None:
        return with_acceleration(best[0], team, best[1])
    assert failed is not None  # some acceleration is allowed, see unproved_position
    return failed


def _rubbed(budget: Budget, team: TeamCouplings, rate: float) -> Budget:
    """Return the budget of the object's origin with the friction of joints that have this rate."""
    if not budget.rubs:
        return budget
    pushes = friction_pushes(budget, team.couplings, rate)
    return rubbed(budget, AxisTracking(1.0, 1.0, disturbance=tuple(pushes.tolist())))


def _sentence(plan: Plan, unproved: UnprovedTransition | UnprovedPosition) -> str:
    """Say where a budget does not hold, with the names of the robot and of the joint."""
    if isinstance(unproved, UnprovedPosition):
        return unproved.reason
    where = f"in transition {unproved.transition} of 0 to {len(plan.transitions) - 1}"
    if unproved.axis is None:
        return f"{where}, {unproved.reason}"
    name = "the object's angle"
    if unproved.axis > 0:
        robot, _, joint = plan.joint_names[unproved.axis - 1].rpartition("::")
        name = f"the joint {joint} of {robot}" if robot else f"the joint {joint}"
    return f"{where}, {name} {unproved.reason}"
