"""Whether a proof of infeasibility holds: covers without gaps, labels that never change where cells touch."""

from __future__ import annotations

from math import remainder

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import BlockedGoalProof, DiscProof, InfeasibilityProof, SlicesProof
from coop_drake.errors import RefusalError
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check, Progress, Verified
from coop_drake.verification.covers import check_blocked, check_cover
from coop_drake.verification.discs import check_disc
from coop_drake.verification.labels import check_labels
from coop_drake.verification.may_be_free import FreePositions
from coop_drake.verification.tiling import TURN, check_tiling, turn_is_whole

__all__ = ["verify_proof"]

SAME_ANGLE = 1e-9
"""Rounding of the goal's angle in any unwrapping [rad]."""


def verify_proof(
    proof: InfeasibilityProof, problem: PlanningProblem, progress: Progress | None = None
) -> Verified:
    """Check a proof that no plan exists.

    What cannot move with some of the robots left out cannot move with all of them, so a proof may keep any
    of them. The goal is the pose itself, not the tolerances about it.

    Args:
        proof: The proof.
        problem: The question that it should refute.
        progress: Called with a phase and the share of it that is done.

    Returns:
        What was checked.

    Raises:
        RefusalError: Names the first claim that does not hold.
    """
    if isinstance(proof, DiscProof):
        checks = check_disc(proof, problem)
        carrier = problem.tree.components[proof.component].name
        subject = f"a disc of {proof.radius:.4f} m in {carrier} cannot get from start to goal"
        return Verified("infeasible", subject, checks)
    robots = proof.robots
    team = f"the object with robots {list(robots)}" if robots else "the object alone"
    bodies = _check_robots(robots, problem)
    if isinstance(proof, SlicesProof):
        checks = (bodies, *_separated(proof, problem, progress))
        subject = f"{len(proof.slices)} slices keep {team} from the goal"
    else:
        checks = (bodies, *_blocked(proof, problem, progress))
        subject = f"{team} collides at the goal in {len(proof.slices)} slices"
    return Verified("infeasible", subject, checks)


def _check_robots(robots: tuple[int, ...], problem: PlanningProblem) -> Check:
    known = sorted({joint.robot for joint in problem.tree.joints})
    if any(robot not in known for robot in robots) or sorted(set(robots)) != list(robots):
        raise RefusalError("robots", f"{list(robots)} are not some of {known}, ascending")
    return Check("bodies that are kept are the team's", len(robots) + 1)


def _axes(robots: tuple[int, ...], problem: PlanningProblem) -> list[int]:
    """Places of theta and of the kept joints among (theta, q...)."""
    return [0, *[1 + joint.index for joint in problem.tree.joints if joint.robot in robots]]


def _ends(
    proof: SlicesProof | BlockedGoalProof, problem: PlanningProblem
) -> tuple[list[int], FloatArray, FloatArray]:
    """The kept axes and both ends of all slices on them, shape (N, m) each."""
    axes = _axes(proof.robots, problem)
    for k, part in enumerate(proof.slices):
        if len(part.lower) != len(axes):
            raise RefusalError(
                f"slices[{k}]", f"has {len(part.lower)} axes; the kept bodies have {len(axes)}"
            )
    lower = np.array([part.lower for part in proof.slices])
    return axes, lower, np.array([part.upper for part in proof.slices])


def _separated(proof: SlicesProof, problem: PlanningProblem, progress: Progress | None) -> tuple[Check, ...]:
    axes, lower, upper = _ends(proof, problem)
    limits = problem.tree.joint_lower, problem.tree.joint_upper
    kept = np.array(axes[1:], dtype=int) - 1
    low = np.array([lower[:, 0].min(), *limits[0][kept]])
    high = np.array([upper[:, 0].max(), *limits[1][kept]])
    if not turn_is_whole(low[0], high[0]):
        raise RefusalError("slices", f"cover theta from {low[0]} to {high[0]}, not a whole turn of {TURN}")
    check_tiling(lower, upper, (low, high))
    goals = [problem.goal_joints[joint] for joint in kept]
    starts = [float(problem.start[2 + axis]) for axis in axes]
    labels = check_labels(proof.slices, starts, [float(problem.goal_pose[2]), *goals], problem)
    free = FreePositions(problem.tree, proof.robots, problem.workspace)
    finest = float("inf")
    for k, part in enumerate(proof.slices):
        ends = _in_all(lower[k], axes, problem), _in_all(upper[k], axes, problem)
        polygons = [cell.polygon for cell in part.cells]
        finest = min(finest, check_cover(free, *ends, polygons, f"slices[{k}]"))
        if progress is not None:
            progress("checking slices", (k + 1) / len(lower))
    return (
        Check("slices tile a turn of theta and the limits of all kept joints", len(lower)),
        Check("cells hold all positions that may be free", len(lower), finest, "m, finest sweep needed"),
        *labels,
    )


def _blocked(
    proof: BlockedGoalProof, problem: PlanningProblem, progress: Progress | None
) -> tuple[Check, ...]:
    axes, lower, upper = _ends(proof, problem)
    low, high = lower.min(axis=0), upper.max(axis=0)
    if low[0] != high[0] or abs(remainder(float(low[0] - problem.goal_pose[2]), TURN)) > SAME_ANGLE:
        raise RefusalError(
            "slices", f"are about theta in [{low[0]}, {high[0]}], not the goal's {problem.goal_pose[2]}"
        )
    for axis, joint in enumerate(axes[1:], start=1):
        goal, limits = problem.goal_joints[joint - 1], problem.tree.joints[joint - 1]
        expected = (limits.lower, limits.upper) if goal is None else (goal, goal)
        low[axis], high[axis] = expected
    check_tiling(lower, upper, (low, high))
    free = FreePositions(problem.tree, proof.robots, problem.workspace)
    for k in range(len(lower)):
        ends = _in_all(lower[k], axes, problem), _in_all(upper[k], axes, problem)
        check_blocked(free, *ends, problem.goal_pose[:2], f"slices[{k}]")
        if progress is not None:
            progress("checking slices", (k + 1) / len(lower))
    return (
        Check("slices tile the goal's angle and the limits of all free kept joints", len(lower)),
        Check("the team collides at the goal's position in every slice", len(lower)),
    )


def _in_all(values: FloatArray, axes: list[int], problem: PlanningProblem) -> FloatArray:
    """Values on the kept axes put in their places among (theta, q...)."""
    whole = np.zeros(1 + len(problem.tree.joints))
    whole[axes] = values
    return whole
