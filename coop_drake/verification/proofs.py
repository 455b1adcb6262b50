"""Verify a proof of infeasibility by code of its own; only data are shared with the planner.

What a proof must show; each function raises a RefusalError at the first place where it does not hold. It
considers the object with some robots, or one disc inside one component: if these cannot move from start to
goal, neither can the team.

1. It is about this problem: ``problem_match.check_digest``.
2. Kind ``slices`` (``check_slices``): the slices cover all angles and joint values
   (``tiling.check_tiling``); in every slice all positions outside the cells are in collision
   (``covers.check_cover``); no sequence of touching cells joins the start to the goal
   (``reachability.check_reachability``).
3. Kind ``disc`` (``discs.check_disc``): the disc lies inside a body of the component, the cells cover all
   positions where it fits on the floor, and no sequence of touching cells joins the start to the goal.
4. Kind ``blocked goal`` (``check_blocked_goal``): slices cover all joint values that are allowed at
   the goal (``tiling.check_tiling``), and in each of them the team collides at the goal's position
   (``covers.check_blocked``).

A change of what a proof holds also concerns ``answers/proof.py`` (its data), ``answers/proof_file.py`` (its
file), ``planning/proofs/proof_making.py`` (which makes it) and ``docs/conventions.md`` (which describes it).
"""

from __future__ import annotations

import numpy as np

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import BlockedGoalProof, DiscProof, InfeasibilityProof, SlicesProof
from coop_drake.errors import RefusalError
from coop_drake.progress import Progress
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check, Verified
from coop_drake.verification.covers import check_blocked, check_cover, check_near_floor
from coop_drake.verification.discs import check_disc
from coop_drake.verification.free_positions import FreePositions
from coop_drake.verification.problem_match import goal_box, same_angle
from coop_drake.verification.reachability import check_reachability
from coop_drake.verification.tiling import check_tiling, turn_is_whole

__all__ = ["verify_proof"]


def verify_proof(
    proof: InfeasibilityProof, problem: PlanningProblem, progress: Progress | None = None
) -> Verified:
    """Check a proof that no plan exists.

    What cannot move from start to goal with some of the robots left out cannot do so with all of them: a
    proof may keep any of them. It is about the goal pose itself, not about the tolerances around it.

    Args:
        proof: The proof.
        problem: The problem that it should refute.
        progress: Called with a phase and the fraction of it that is done.

    Returns:
        What was checked.

    Raises:
        RefusalError: Names the first statement that does not hold.
    """
    if isinstance(proof, DiscProof):
        checks = check_disc(proof, problem)
        carrier = problem.tree.components[proof.component].name
        subject = f"a disc of {proof.radius:.4f} m in {carrier} cannot get from start to goal"
        return Verified("infeasible", subject, checks)
    robots, count = list(proof.robots), len(proof.slices)
    team = f"the object with robots {robots}" if robots else "the object alone"
    if isinstance(proof, SlicesProof):
        checks = check_slices(proof, problem, progress)
        subject = f"{team} cannot get from start to goal, by {count} slices"
    else:
        checks = check_blocked_goal(proof, problem, progress)
        subject = f"{team} collides at the goal, by {count} slices"
    return Verified("infeasible", subject, checks)


def check_slices(
    proof: SlicesProof, problem: PlanningProblem, progress: Progress | None
) -> tuple[Check, ...]:
    """Check that slices cover all angles and cells all free positions, and keep start and goal apart."""
    robots, axes = _check_robots(proof, problem)
    lower, upper = _ends(proof, axes)
    limits = [(problem.tree.joint_lower[axis - 1], problem.tree.joint_upper[axis - 1]) for axis in axes[1:]]
    low, high = np.array([(lower[:, 0].min(), upper[:, 0].max()), *limits]).T
    if not turn_is_whole(low[0], high[0]):
        raise RefusalError("slices", f"cover theta from {low[0]} to {high[0]}, not a whole turn")
    check_tiling(lower, upper, (low, high))
    goals = [float(problem.goal_pose[2]), *[problem.goal_joints[axis - 1] for axis in axes[1:]]]
    labels = check_reachability(proof.slices, problem.start[2:][axes].tolist(), goals, problem)
    free = FreePositions(problem.tree, proof.robots, problem.workspace)
    finest = float("inf")
    for k, part in enumerate(proof.slices):
        ends = _in_all(lower[k], axes, problem), _in_all(upper[k], axes, problem)
        polygons = [cell.polygon for cell in part.cells]
        check_near_floor(polygons, problem, f"slices[{k}]")
        finest = min(finest, check_cover(free, *ends, polygons, f"slices[{k}]"))
        if progress is not None:
            progress("checking slices", (k + 1) / len(lower))
    return (
        robots,
        Check("slices tile a turn of theta and the limits of all kept joints", len(lower)),
        Check("cells hold all positions that may be free", len(lower), finest, "m, finest sweep needed"),
        *labels,
    )


def check_blocked_goal(
    proof: BlockedGoalProof, problem: PlanningProblem, progress: Progress | None
) -> tuple[Check, ...]:
    """Check that the team collides at the goal at all values of its free joints."""
    robots, axes = _check_robots(proof, problem)
    lower, upper = _ends(proof, axes)
    low, high = (ends[axes] for ends in goal_box(problem))
    first, last = lower[:, 0].min(), upper[:, 0].max()
    if first != last or not same_angle(first, low[0]):
        raise RefusalError("slices", f"are about theta in [{first}, {last}], not the goal's {low[0]}")
    low[0] = high[0] = first
    check_tiling(lower, upper, (low, high))
    free = FreePositions(problem.tree, proof.robots, problem.workspace)
    for k in range(len(lower)):
        ends = _in_all(lower[k], axes, problem), _in_all(upper[k], axes, problem)
        check_blocked(free, *ends, problem.goal_pose[:2], f"slices[{k}]")
        if progress is not None:
            progress("checking slices", (k + 1) / len(lower))
    return (
        robots,
        Check("slices tile the goal's angle and the limits of all free kept joints", len(lower)),
        Check("the team collides at the goal's position in every slice", len(lower)),
    )


def _check_robots(proof: SlicesProof | BlockedGoalProof, problem: PlanningProblem) -> tuple[Check, list[int]]:
    """Check the kept robots; find the places of theta and of their joints among (theta, q...)."""
    robots = list(proof.robots)
    known = sorted({joint.robot for joint in problem.tree.joints})
    if any(robot not in known for robot in robots) or sorted(set(robots)) != robots:
        raise RefusalError("robots", f"{robots} must be a subset of {known}, in ascending order")
    axes = [0, *[1 + joint.index for joint in problem.tree.joints if joint.robot in robots]]
    return Check("the robots that are kept are the team's", len(robots) + 1), axes


def _ends(proof: SlicesProof | BlockedGoalProof, axes: list[int]) -> tuple[FloatArray, FloatArray]:
    """Both ends of all slices on the kept axes, shape (N, m) each."""
    for k, part in enumerate(proof.slices):
        if len(part.lower) != len(axes):
            raise RefusalError(
                f"slices[{k}]", f"has {len(part.lower)} axes; the kept bodies have {len(axes)}"
            )
    lower, upper = zip(*[(part.lower, part.upper) for part in proof.slices], strict=True)
    return np.array(lower), np.array(upper)


def _in_all(values: FloatArray, axes: list[int], problem: PlanningProblem) -> FloatArray:
    """Values on the kept axes put in their places among (theta, q...)."""
    whole = np.zeros(1 + len(problem.tree.joints))
    whole[axes] = values
    return whole
