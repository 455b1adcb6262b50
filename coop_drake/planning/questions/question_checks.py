"""Checks of a question before the search: finite numbers of the right count, joints within their limits."""

from __future__ import annotations

import numpy as np
import shapely

from coop_drake.answers.problem import ROUNDING, PlanningProblem, goal_box
from coop_drake.errors import PlanError
from coop_drake.tree.component_tree import TreeJoint
from coop_drake.tree.pose import FloatArray


def check_question(problem: PlanningProblem) -> None:
    """Refuse a question without meaning.

    Raises:
        PlanError: Names the entry, its value and what is allowed.
    """
    joints = problem.tree.joints
    _check_numbers("start", problem.start, 3 + len(joints), "x, y, theta and every joint")
    _check_numbers("goal_pose", problem.goal_pose, 3, "x, y and theta")
    if len(problem.goal_joints) != len(joints):
        raise PlanError(
            f"goal_joints: {list(problem.goal_joints)} is not allowed; expected {len(joints)} entries, a "
            f"value or None for every joint"
        )
    if not np.isfinite(shapely.get_coordinates(problem.workspace)).all():
        raise PlanError("workspace: has corners that are not allowed; expected finite numbers")
    for joint in joints:
        endless = joint.circular and joint.kind == "revolute"
        if not (endless or -np.inf < joint.lower <= joint.upper < np.inf):
            raise PlanError(
                f"limits of {joint.name}: [{joint.lower}, {joint.upper}] are not allowed; expected two "
                f"finite limits, the lower one first, or none for a revolute joint, which is a circle then"
            )
        start, goal = float(problem.start[3 + joint.index]), problem.goal_joints[joint.index]
        if not _within(start, joint):
            raise PlanError(
                f"start: {start} of {joint.name} is not allowed; expected a value within its limits "
                f"[{joint.lower}, {joint.upper}]"
            )
        if goal is not None and not np.isfinite(goal):
            raise PlanError(f"goal_joints: {goal} of {joint.name} is not allowed; expected a finite number")


def goal_beyond_limits(problem: PlanningProblem) -> str | None:
    """A sentence that names a joint whose goal is beyond its limits by more than its tolerance, or None."""
    for joint, (low, high) in zip(problem.tree.joints, goal_box(problem)[1:], strict=True):
        if low > high:
            goal, limits = problem.goal_joints[joint.index], f"[{joint.lower}, {joint.upper}]"
            return (
                f"at the goal {joint.name} is {goal}, beyond its limits {limits} by more than its tolerance"
            )
    return None


def _check_numbers(key: str, values: FloatArray, count: int, names: str) -> None:
    if np.shape(values) != (count,) or not np.isfinite(values).all():
        raise PlanError(
            f"{key}: {np.asarray(values).tolist()} is not allowed; expected {count} finite numbers: {names}"
        )


def _within(value: float, joint: TreeJoint) -> bool:
    return joint.lower - ROUNDING <= value <= joint.upper + ROUNDING
