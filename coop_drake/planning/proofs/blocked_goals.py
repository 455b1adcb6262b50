"""Goals at which the team collides whatever its free joints: refuted before any search."""

from __future__ import annotations

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import BlockedGoalProof
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.slices import halves
from coop_drake.planning.proofs.proof_making import blocked_goal_proof
from coop_drake.planning.questions.margins import shrunk
from coop_drake.planning.questions.relaxation import relaxed

_BUDGET = 128


def blocked_goal(problem: PlanningProblem) -> tuple[BlockedGoalProof | None, int]:
    """Whether no values of the free joints put the team freely at its goal; a proof, by under-sweeps.

    The object goes first, then each robot alone, then all: what is blocked for some is blocked for the team.

    Args:
        problem: The question, whose margin is zero.

    Returns:
        The proof that the goal is in collision, None if there is none, and the slices swept for it.
    """
    robots = sorted({joint.robot for joint in problem.tree.joints})
    slices = 0
    for chosen in dict.fromkeys([(), *[(robot,) for robot in robots], tuple(robots)]):
        boxes, made = _blocked(relaxed(problem, chosen)[0])
        slices += made
        if boxes:
            return blocked_goal_proof(chosen, boxes), slices
    return None, slices


def _blocked(question: PlanningProblem) -> tuple[list[Intervals], int]:
    """Boxes of all free joints' values in which the team collides at the goal; none if it does not in all.

    Halve the free joints' intervals until all are blocked, one is free, or the budget is spent.
    """
    swept = SweptTree(question.tree)
    maker = CellMaker(swept, BodyPairs(swept), shrunk(question.workspace, 0.0))
    angle = float(question.goal_pose[2])
    joints = [
        (joint.lower, joint.upper) if goal is None else (goal, goal)
        for joint, goal in zip(question.tree.joints, question.goal_joints, strict=True)
    ]
    left: list[Intervals] = [((angle, angle), *joints)]
    blocked: list[Intervals] = []
    for made in range(1, _BUDGET + 1):
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
    return [], _BUDGET


def _held(regions: list[Region], question: PlanningProblem) -> bool:
    return any(region.holds(question.goal_pose[:2]) for region in regions)
