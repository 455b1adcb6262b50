"""Goals that are blocked whatever the free joints: which bodies, which walls, by how much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.bracket import Steps, bracketed
from coop_drake.diagnosis.contacts import Contact, Overlap, contacts, overlaps
from coop_drake.diagnosis.diagnosis import BlockedPose
from coop_drake.diagnosis.growth import Growth
from coop_drake.diagnosis.trials import Answer, Trial, Trials
from coop_drake.planning.proofs.blocked_goals import blocked_goal
from coop_drake.tree.pose import FloatArray

__all__ = ["blocked_pose"]

_TRIED = 256
_REFINED = 120
_RESOLUTION = 0.002


def blocked_pose(problem: PlanningProblem, growth: Growth, trials: Trials) -> BlockedPose:
    """Say what is in the way at the goal.

    The configuration is the least bad one among joints spread evenly and then moved one by one; the growth
    is asked of the same sweeps that proved the goal to be blocked.

    Args:
        problem: The question.
        growth: Moves walls back.
        trials: Keeps account of the work.
    """
    z = _least_bad(problem)

    def ask(amount: float) -> Trial:
        grown = replace(problem, workspace=growth.everywhere(amount))
        blocked, slices = blocked_goal(grown)
        trials.spent += slices
        if blocked:
            return Trial(grown, Answer.INFEASIBLE)
        free = worst(grown, _least_bad(grown)) <= 0.0
        return Trial(grown, Answer.FOUND if free else Answer.UNDECIDED)

    steps = Steps(0.02, growth.most, _RESOLUTION)
    return BlockedPose(
        z, tuple(_contacts(problem, z)), tuple(overlaps(problem.tree, z)), bracketed(ask, steps)
    )


def _contacts(problem: PlanningProblem, z: FloatArray) -> list[Contact]:
    return contacts(problem.workspace, problem.tree, z)


def worst(problem: PlanningProblem, z: FloatArray) -> float:
    """How deep the deepest contact or overlap is [m]."""
    found: list[Contact | Overlap] = [*_contacts(problem, z), *overlaps(problem.tree, z)]
    return max((fault.depth for fault in found), default=0.0)


def _least_bad(problem: PlanningProblem) -> FloatArray:
    """A configuration at the goal with as little contact as was found; ties go to the first."""
    joints = problem.tree.joints
    free = [joint.index for joint in joints if problem.goal_joints[joint.index] is None]
    fixed = [0.0 if value is None else value for value in problem.goal_joints]
    z = np.array([*problem.goal_pose, *fixed])
    if not free:
        return z
    lower, upper = problem.tree.joint_lower[free], problem.tree.joint_upper[free]
    columns = [3 + index for index in free]
    spread = qmc.Halton(len(free), scramble=False).random(_TRIED)
    tried = []
    for share in spread:
        candidate = z.copy()
        candidate[columns] = lower + share * (upper - lower)
        tried.append((worst(problem, candidate), candidate))
    return _refined(problem, *min(tried, key=lambda entry: entry[0]), columns)


def _refined(problem: PlanningProblem, cost: float, z: FloatArray, columns: list[int]) -> FloatArray:
    """Move joints one by one, with steps that are halved whenever none helps."""
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    step, asked = 0.1, 0
    while asked < _REFINED and cost > 0.0 and step > 1e-3:
        before = cost
        for column in columns:
            for sign in (-1.0, 1.0):
                other = z.copy()
                other[column] = np.clip(z[column] + sign * step, lower[column - 3], upper[column - 3])
                asked += 1
                here = worst(problem, other)
                if here < cost:
                    cost, z = here, other
        if cost >= before:
            step *= 0.5
    return z
