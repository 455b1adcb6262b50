"""Check that the team of a plan with a motion tolerates the budget that the plan states.

The plan states with which gains the team is pulled to its motion, and a pull q that reproduces itself: if no
command's pull has been larger until now, none is at the next sample. The departures, the levels of monitors
and the room that the motion keeps in its cells follow from this; ``check_motion`` checks that it keeps it.
What follows in one step is computed in ``robustness/tracking.py``, which the planner uses, too.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import shapely

from coop_drake.answers.budget import LIMITS, Budget, Departures
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.robustness.couplings import QUICKEST, team_couplings
from coop_drake.robustness.tracking import (
    HORIZON,
    departures_after,
    goal_tolerances,
    largest_efforts,
    moving_of,
    stated_departures,
    team_loop,
)
from coop_drake.tree import ComponentTree
from coop_drake.tree.arrays import FloatArray
from coop_drake.verification.checks import Check

ROUNDING = 1e-9
"""Differences that rounding explains, relative [-]."""


def check_departures(plan: Plan, problem: PlanningProblem) -> list[Check]:
    """Check what a plan states about its budget; nothing for a plan without one.

    Args:
        plan: The plan, whose motion has been checked, and with it how many numbers are stated.
        problem: The question.

    Raises:
        RefusalError: Names the entry, and what the budget gives.
    """
    budget, stated, motion = plan.budget, plan.departures, plan.motion
    if budget is None:
        parts = {f"transitions[{k}].governed": one.governed for k, one in enumerate(plan.transitions)}
        for where, part in {"departures": stated, **parts}.items():
            if part is not None:
                raise RefusalError(where, "is stated, but the plan has no budget")
        return []
    if stated is None or motion is None:
        raise RefusalError(
            "departures" if stated is None else "motion", "is missing, but the plan has a budget"
        )
    loop = team_loop(motion.gains, budget, plan.start.size - 2)
    if loop is None:
        finding = f"the team does not come to rest within {HORIZON} s for every error of the model"
        raise RefusalError("motion.gains", finding)
    team, moving = team_couplings(budget, problem.tree, plan.cells), moving_of(motion)
    again = departures_after(loop, moving, team.couplings, stated.pull)[0][3]
    _require(stated.pull, again, "departures.pull", least=True)
    due = stated_departures(loop, moving, team.couplings, stated.pull)
    for name in (field.name for field in fields(Departures) if field.name not in ("pull", "effort")):
        _require(getattr(stated, name), getattr(due, name), f"departures.{name}")
    off = np.array([
        np.hypot(*(motion.points[-1, :2] - plan.goal_pose[:2])),
        *(
            0.0 if goal is None else abs(end - goal)
            for end, goal in zip(motion.points[-1, 2:], (plan.goal_pose[2], *plan.goal_joints), strict=True)
        ),
    ])  # fmt: skip
    tolerances = goal_tolerances(problem)
    if not (off + stated.rest <= tolerances + ROUNDING).all():
        channel = int(np.argmax((off + stated.rest) / tolerances))
        finding = (
            f"is {stated.rest[channel]:.6g}, and the motion ends {off[channel]:.6g} from the goal; its "
            f"tolerance is {tolerances[channel]:g}"
        )
        raise RefusalError(f"departures.rest[{channel}]", finding)
    least = _check_regions(plan, float(stated.room[0]))
    checks = [
        Check("departures from the motion follow from the budget", 11 * stated.pull.size),
        Check("regions leave room for departures", len(plan.cells), least, "m more than needed"),
    ]
    if team.efforts is None:
        return checks
    rates = moving.rate[:, 1:] + budget.ahead * moving.acceleration[:, 1:]
    if not rates.max() <= QUICKEST:
        finding = f"is no bound for axes that turn at {rates.max():.3g}, above {QUICKEST:g}"
        raise RefusalError("departures.effort", finding)
    asked = largest_efforts(budget, motion.gains, team.efforts, moving, stated)
    _require(stated.effort, asked, "departures.effort")
    over = stated.effort > team.efforts.limits
    if over.any():
        worst = int(np.argmax(over))
        finding = f"is {stated.effort[worst]:.6g}; the limit is {team.efforts.limits[worst]:g}"
        raise RefusalError(f"departures.effort[{worst}]", finding)
    return checks + _of_efforts(budget, stated.effort)


def check_shapes(stated: Departures, budget: Budget, tree: ComponentTree) -> None:
    """Refuse statements of another length, and budgets of another team."""
    joints = len(tree.joints)
    for field in fields(Departures):
        count = 2 + joints
        if field.name == "effort":
            count = len(budget.effort_limits(joints)) if budget.limited else 0
        if getattr(stated, field.name).size != count:
            finding = f"has {getattr(stated, field.name).size} numbers, not {count}"
            raise RefusalError(f"departures.{field.name}", finding)
    for name, rows in (("bodies", budget.bodies), ("bases", budget.bases)):
        if max((row[0] for row in rows), default=0) >= len(tree.components):
            raise RefusalError(f"budget.{name}", f"expected components below {len(tree.components)}")
    for name in ("rotors", "dampings"):
        if len(getattr(budget, name)) not in (0, joints):
            found = f"has {len(getattr(budget, name))} numbers, not {joints}"
            raise RefusalError(f"budget.{name}", found)


def _require(stated: FloatArray, due: FloatArray, where: str, *, least: bool = False) -> None:
    """Refuse a number that is not the one that follows, or with ``least`` one that is below it."""
    good = stated >= due * (1.0 - ROUNDING) if least else np.abs(stated - due) <= ROUNDING * (1.0 + due)
    if not good.all():
        channel = int(np.argmin(good))
        finding = f"is {stated[channel]:.9g}; the budget gives {due[channel]:.9g}"
        raise RefusalError(f"{where}[{channel}]", finding)


def _check_regions(plan: Plan, room: float) -> float:
    """Check that regions are so far inside their cells; return by how much more than needed [m]."""
    least = np.inf
    for k, (cell, transition) in enumerate(zip(plan.cells, plan.transitions, strict=True)):
        region, where = transition.governed, f"transitions[{k}].governed"
        if region is None:
            raise RefusalError(where, "is missing, but the plan has a budget")
        if not cell.tidied.contains(region):
            raise RefusalError(where, "leaves its cell")
        away = float(shapely.distance(region.boundary, cell.tidied.boundary))
        if not away >= room:
            finding = f"comes within {away:.6g} m of the cell's boundary; departures need {room:.6g} m"
            raise RefusalError(where, finding)
        least = min(least, away - room)
    return least


def _of_efforts(budget: Budget, stated: FloatArray) -> list[Check]:
    """Return the smallest room of the limited efforts."""
    robots, checks = budget.robots, list[Check]()
    parts = stated[:robots], stated[robots : 2 * robots], stated[2 * robots :]
    units = "N to spare", "N m to spare", "N m or N to spare"
    for name, part, unit in zip(LIMITS, parts, units, strict=True):
        limit = getattr(budget, name)
        if limit is not None and part.size:
            what = f"no {name.replace('_', ' ')} is asked for beyond its limit under the budget"
            checks.append(Check(what, part.size, limit - float(part.max()), unit))
    return checks
