"""Check which limits of the scenario a plan states to break: that it does, by its own figures."""

from __future__ import annotations

from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.tree.usual_unit import usual_unit
from coop_drake.verification.checks import Check


def check_refusals(plan: Plan, problem: PlanningProblem) -> Check:
    """Compare every limit with the scenario's, and the value that breaks it with the plan's transition.

    Raises:
        RefusalError: Names the entry, and what it should be.
    """
    settings, least = problem.settings, 1.0
    clearance = usual_unit(problem.tree) * settings.min_clearance
    accelerations = {
        joint.name: (float(limit), "m/s^2" if joint.kind == "prismatic" else "rad/s^2", joint.name)
        for joint, limit in zip(problem.tree.joints, problem.limits.joint_accelerations, strict=False)
    }  # empty where no limit is known
    for k, refusal in enumerate(plan.refused_by):
        where = f"refused_by[{k}]"
        if refusal.cell >= len(plan.transitions):
            raise RefusalError(f"{where}.cell", f"{refusal.cell} is none of {len(plan.transitions)} cells")
        transition = plan.transitions[refusal.cell]
        values, stated = {
            "planner.min_clearance": ({transition.neck, transition.inradius}, (clearance, "m", "")),
            "planner.max_transition_time": (
                {transition.estimated_time},
                (settings.max_transition_time, "s", ""),
            ),
            "limits.joint_accelerations": ({refusal.value}, accelerations.get(refusal.joint)),
        }.get(refusal.limit, (set(), None))
        if refusal.value not in values or (refusal.allowed, refusal.unit, refusal.joint) != stated:
            raise RefusalError(where, f"{refusal.describe()}: these are not the plan's and the scenario's")
        room = (refusal.value - refusal.allowed) / refusal.allowed
        room = -room if refusal.limit == "planner.min_clearance" else room
        if room <= 0.0:
            raise RefusalError(where, f"{refusal.describe()}: it is kept")
        least = min(least, room)
    return Check("limits of the scenario that the plan breaks", len(plan.refused_by), least, "of one beyond")
