"""The limits of a scenario with which a plan along a way that exists cannot be carried out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from coop_drake.answers.limits import Refusal, Unit
from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.execution.acceleration_limits import planned_accelerations
from coop_drake.planning.execution.estimate import estimated
from coop_drake.tree.usual_unit import usual_unit

GOAL_REGION_FRACTION = 0.9
"""The region of the goal need not be wider than this fraction of the position tolerance [-]."""


def without_limits(problem: PlanningProblem) -> PlanningProblem:
    """The question for which no passage is too narrow, no transition too long and no joint too quick."""
    settings = replace(problem.settings, min_clearance=0.0, max_transition_time=inf)
    limits = replace(problem.limits, joint_accelerations=np.empty(0))
    return replace(problem, settings=settings, limits=limits)


def refusals(problem: PlanningProblem, plan: Plan) -> tuple[Refusal, ...]:
    """Limits that a plan breaks, each with the cell in which it does so most; none if it can be carried out.

    Args:
        problem: What was asked, with the limits.
        plan: A plan that may have been made without them.
    """
    return tuple(_refusals(problem, plan))


def _refusals(problem: PlanningProblem, plan: Plan) -> Iterator[Refusal]:
    settings, transitions = problem.settings, plan.transitions
    least = usual_unit(problem.tree) * settings.min_clearance
    clear = [min(transition.neck, transition.inradius) for transition in transitions]
    if transitions[-1].inradius >= min(least, GOAL_REGION_FRACTION * problem.position_tolerance):
        clear[-1] = transitions[-1].neck
    yield from _broken(clear, -1, "planner.min_clearance", least, "m")
    times = [transition.estimated_time for transition in transitions]
    yield from _broken(times, 1, "planner.max_transition_time", settings.max_transition_time, "s")
    most = planned_accelerations(problem.limits)
    if most is not None:
        shares = estimated(plan)[2] / most
        axis = int(np.argmax(shares.max(axis=0)))
        limit = float(problem.limits.joint_accelerations[axis - 1])  # Of it, a share is planned with.
        values, joint = (limit * shares[:, axis]).tolist(), problem.tree.joints[axis - 1]
        unit: Unit = "rad/s^2" if joint.kind == "revolute" else "m/s^2"
        cell = int(np.argmax(shares[:, axis]))
        if shares[cell, axis] >= 1.0:  # The gains' limit acts, if it has not been left out.
            yield Refusal("limits.joint_accelerations", cell, values[cell], limit, unit, joint.name)


def _broken(
    values: Sequence[float], sign: int, limit: str, allowed: float, unit: Unit, joint: str = ""
) -> Iterator[Refusal]:
    """The cell that breaks a limit most: from above with sign 1, from below with -1."""
    cell = max(range(len(values)), key=lambda k: sign * values[k])
    if sign * values[cell] > sign * allowed:
        yield Refusal(limit, cell, values[cell], allowed, unit, joint)
