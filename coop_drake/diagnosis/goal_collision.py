"""What collides at a goal that is blocked whatever the free joints: bodies, walls, depths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from coop_drake.answers import PlanningProblem
from coop_drake.answers.problem import at_goal
from coop_drake.diagnosis.bracket import Amounts, bracketed
from coop_drake.diagnosis.contacts import Contact, Overlap, contacts, overlaps
from coop_drake.diagnosis.findings import BlockedPose
from coop_drake.diagnosis.variants import Answer, BudgetedPlanner, Outcome
from coop_drake.diagnosis.widened_floor import WidenedFloor
from coop_drake.planning.blocked_goal import blocked_goal
from coop_drake.tree.pose import FloatArray

TRIED = 256
"""Values of the free joints that are tried, spread evenly over their limits [-]."""

REFINED = 120
"""Configurations that are tried near the best of these [-]."""

STEPS = (0.1, 1e-3)
"""First and smallest step of a joint in these [rad or m]."""

FIRST, RESOLUTION = 0.02, 0.002
"""First distance by which walls are moved back, and how closely the least one is looked for [m]."""


def blocked_pose(problem: PlanningProblem, floor: WidenedFloor, planner: BudgetedPlanner) -> BlockedPose:
    """Say what collides at the goal, and how far the walls must move back.

    The configuration shown has the least collision of those tried. That walls moved back by some distance are
    not enough is proved by the same sweeps that proved the goal to be blocked.
    """
    z = _least_collision(problem)

    def ask(amount: float) -> Outcome:
        grown = replace(problem, workspace=floor.everywhere(amount))
        blocked, slices = blocked_goal(grown)
        planner.spent += slices
        if blocked:
            return Outcome(grown, Answer.INFEASIBLE)
        free = _worst(grown, _least_collision(grown)) <= 0.0
        return Outcome(grown, Answer.FOUND if free else Answer.UNDECIDED)

    touched = tuple(contacts(problem.workspace, problem.tree, z))
    bracket = bracketed(ask, Amounts(FIRST, floor.most, RESOLUTION))
    return BlockedPose(z, touched, tuple(overlaps(problem.tree, z)), bracket)


def _worst(problem: PlanningProblem, z: FloatArray) -> float:
    """Depth of the deepest contact or overlap [m]."""
    found: list[Contact | Overlap] = [
        *contacts(problem.workspace, problem.tree, z),
        *overlaps(problem.tree, z),
    ]
    return max((fault.depth for fault in found), default=0.0)


def _least_collision(problem: PlanningProblem) -> FloatArray:
    """The configuration at the goal with the least collision of those tried; ties go to the first."""
    joints = problem.tree.joints
    free = [joint.index for joint in joints if problem.goal_joints[joint.index] is None]
    z = at_goal(problem.goal_pose, problem.goal_joints, 0.0)
    if not free:
        return z
    lower, upper = problem.tree.range_lower[free], problem.tree.range_upper[free]
    columns = [3 + index for index in free]
    spread = qmc.Halton(len(free), scramble=False).random(TRIED)
    tried = []
    for fraction in spread:
        candidate = z.copy()
        candidate[columns] = lower + fraction * (upper - lower)
        tried.append((_worst(problem, candidate), candidate))
    return _refined(problem, *min(tried, key=lambda entry: entry[0]), columns)


def _refined(problem: PlanningProblem, cost: float, z: FloatArray, columns: list[int]) -> FloatArray:
    """Move joints one by one, with steps that are halved whenever no joint helps."""
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    (step, smallest), asked = STEPS, 0
    while asked < REFINED and cost > 0.0 and step > smallest:
        before = cost
        for column in columns:
            for sign in (-1.0, 1.0):
                other = z.copy()
                other[column] = np.clip(z[column] + sign * step, lower[column - 3], upper[column - 3])
                asked += 1
                here = _worst(problem, other)
                if here < cost:
                    cost, z = here, other
        if cost >= before:
            step *= 0.5
    return z
