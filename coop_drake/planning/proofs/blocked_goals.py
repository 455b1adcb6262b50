"""Goal poses at which the team is in collision for all values of its free joints."""

from __future__ import annotations

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.slices import halves
from coop_drake.planning.proofs.blocked_goal_proof import blocked_goal_proof
from coop_drake.planning.proofs.witnesses import Witnesses
from coop_drake.planning.questions.margins import shrunk
from coop_drake.planning.questions.question_checks import goal_beyond_limits
from coop_drake.planning.questions.relaxation import relaxed

BUDGET = 128
"""Slices of joint intervals that are swept at most for each part of the team: milliseconds of work."""


def blocked_goal(problem: PlanningProblem) -> tuple[InfeasibilityProof | None, int]:
    """Prove by under-sweeps that the team is in collision at its goal pose, whatever its free joints are.

    The object is tested first, then each robot alone, then the team: if some of the bodies collide, so
    does the team.

    Args:
        problem: The question, whose margin is zero.

    Returns:
        The proof, None if there is none, and the slices swept for it.
    """
    robots = sorted({joint.robot for joint in problem.tree.joints})
    slices = 0
    for chosen in dict.fromkeys([(), *[(robot,) for robot in robots], tuple(robots)]):
        question = relaxed(problem, chosen)[0]
        swept = SweptTree(question.tree)
        pairs = BodyPairs(swept)
        boxes, made = _blocked(question, CellMaker(swept, pairs, shrunk(question.workspace, 0.0)))
        slices += made
        beyond = goal_beyond_limits(question) is not None
        if boxes or beyond:
            proof = blocked_goal_proof(question, boxes, Witnesses(problem.tree, swept, pairs))
            if proof is not None:
                return proof, slices
    return None, slices


def _blocked(question: PlanningProblem, maker: CellMaker) -> tuple[list[Intervals], int]:
    """Boxes that cover all values of the free joints, in each of which the team is in collision at the goal.

    The free joints' intervals are halved until all are blocked, one is free, or the budget is spent; only in
    the first case boxes are returned. The second result is the number of slices swept.
    """
    angle = float(question.goal_pose[2])
    joints = [
        (joint.lower, joint.upper) if goal is None else (goal, goal)
        for joint, goal in zip(question.tree.joints, question.goal_joints, strict=True)
    ]
    left: list[Intervals] = [((angle, angle), *joints)]
    blocked: list[Intervals] = []
    for made in range(1, BUDGET + 1):
        intervals = left.pop()
        if _held(maker.over_cells(intervals), question):
            widths = [upper - lower for lower, upper in intervals]
            widest = widths.index(max(widths))
            if widths[widest] == 0.0 or _held(maker.guide_cells(intervals), question):
                return [], made
            left.extend(halves(intervals, widest))
        else:
            blocked.append(intervals)
        if not left:
            return blocked, made
    return [], BUDGET


def _held(regions: list[Region], question: PlanningProblem) -> bool:
    return any(region.holds(question.goal_pose[:2]) for region in regions)
