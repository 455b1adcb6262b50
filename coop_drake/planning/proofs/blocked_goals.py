"""Goals at which the team is in collision, within all tolerances and for all values of its free joints."""

from __future__ import annotations

import shapely
from shapely import MultiPolygon
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem, at_goal, goal_box
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.slices import halves
from coop_drake.planning.proofs.blocked_goal_proof import blocked_goal_proof
from coop_drake.planning.proofs.witnesses import Witnesses
from coop_drake.planning.questions.floor_near import nearby
from coop_drake.planning.questions.margins import shrunk
from coop_drake.planning.questions.question_checks import goal_beyond_limits
from coop_drake.planning.questions.relaxation import relaxed

TOUCH = 1e-5
"""Bodies that are nearer to a wall than this all but touch it [m]."""

BUDGET = 128
"""Slices of joint intervals that are swept at most for each part of the team: milliseconds of work."""


def blocked_goal(problem: PlanningProblem) -> tuple[InfeasibilityProof | None, int]:
    """Prove by under-sweeps that the team is in collision all over its goal, whatever its free joints are.

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
        swept, floor = SweptTree(question.tree), _floor_at_goal(question)
        pairs = BodyPairs(swept)
        beyond = goal_beyond_limits(question) is not None
        boxes, made = ([], 0) if beyond else _blocked(question, CellMaker(swept, pairs, floor))
        slices += made
        if boxes or beyond:
            proof = blocked_goal_proof(question, boxes, floor, Witnesses(problem.tree, swept, pairs))
            if proof is not None:
                return proof, slices
    return None, slices


def touch_at_goal(problem: PlanningProblem) -> str | None:
    """A sentence about a body that all but touches a wall at the goal pose, None if there is none.

    Only bodies are looked at whose joints all have goals.
    """
    tree, goals = problem.tree, problem.goal_joints
    poses = tree.poses(at_goal(problem.goal_pose, goals, 0.0))
    for index, (component, pose) in enumerate(zip(tree.components, poses, strict=True)):
        joints = [tree.components[k].joint for k in tree.ancestors[index]]
        if any(joint is not None and goals[joint.index] is None for joint in joints):
            continue
        for body in component.bodies:
            for shape in body.shapes:
                hull = shapely.MultiPoint(pose.apply(shape.vertices)).convex_hull
                if hull.distance(problem.workspace.boundary) - shape.radius < TOUCH:
                    return f"at the goal pose {body.name} all but touches a wall, or touches it"
    return None


def _floor_at_goal(question: PlanningProblem) -> MultiPolygon:
    """The part of the floor that the team may meet at its goal; all of it if geometry fails."""
    reach = question.tree.reach + question.position_tolerance
    try:
        near = nearby(question.workspace, question.goal_pose[None, :2], reach)
    except ShapelyError:  # The floor crosses itself.
        near = MultiPolygon()
    return shrunk(question.workspace, 0.0) if near.is_empty else near


def _blocked(question: PlanningProblem, maker: CellMaker) -> tuple[list[Intervals], int]:
    """Boxes that cover ``goal_box``, in each of which the team is in collision at all positions of the goal.

    Intervals are halved until all are blocked, one is free, or the budget is spent; only in the first case
    boxes are returned. The second result is the number of slices swept.
    """
    left: list[Intervals] = [goal_box(question)]
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
    return any(region.near(question.goal_pose[:2], question.position_tolerance) for region in regions)
