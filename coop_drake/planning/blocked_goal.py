"""Goals at which the team is in collision, within all tolerances and for all values of its free joints."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import cos, pi

import numpy as np
import shapely
from shapely import MultiPolygon, Point, Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem, at_goal, goal_box
from coop_drake.answers.proof import InfeasibilityProof, OverCell, OverSlice, Witness
from coop_drake.geometry.minkowski import FreeSpace
from coop_drake.geometry.sweeps import normals
from coop_drake.geometry.swept_tree import BodyPairs, Interval, Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, Region
from coop_drake.planning.cells.slices import halves
from coop_drake.planning.certificates import FAILURES, Floor, Witnesses
from coop_drake.planning.questions import EXTRA_FLOOR, goal_beyond_limits, nearby, relaxed, shrunk
from coop_drake.tree.pose import FloatArray

# A blocked goal as a proof: slices of one cell that leaves out positions about the goal, in collision.

NEAR_GOAL = (1e-3, 1e-5, 1e-7)
"""Slices about the goal reach so far from the goals of theta and joints, in the order tried [rad or m]."""

LEAST_DEPTH = 1e-8
"""A goal less deep inside the positions that are in collision counts as touching only [m]."""

CORNERS = (4, 16, 64, 256, 1024)
"""Corners of the polygon about the goal's positions, the fewest that keep enough distance from them [-]."""

TINY = 1e-12
"""The edges of this polygon are further from the goal than the tolerance, by more than is rounded [m]."""

MOST_SLICES = 1024
"""Slices away from the goal that are made at most, until in each a piece is known to hold a polygon [-]."""


def blocked_goal_proof(
    problem: PlanningProblem, boxes: Sequence[Intervals], floor: MultiPolygon, witnesses: Witnesses
) -> InfeasibilityProof | None:
    """Write down that the team is in collision all over its goal.

    Slices about the goal have one cell, which leaves out positions about the goal's; all others have one cell
    that leaves out nothing.

    Args:
        problem: The question with the robots that are kept.
        boxes: Boxes that cover ``goal_box``, in each of which the team is in collision at all of the goal's
            positions; none if the goal of a joint is beyond its limits.
        floor: The floor that the team may meet at the goal.
        witnesses: Makes what shows collisions.

    Returns:
        The proof, None if the team is not known to be in collision by more than a touch.
    """
    writer = _Writer(problem, floor, witnesses)
    for near in NEAR_GOAL:
        whole, goal = writer.ranges(near)
        parts = [writer.near_goal(box, goal) for box in boxes] if len(goal) == len(whole) else []
        if None not in parts:
            rest = writer.rest(whole, goal)
            if rest is not None:
                slices = (*[part for part in parts if part is not None], *rest)
                return InfeasibilityProof("blocked goal", 0, np.zeros(2), slices)
    return None


class _Writer:
    def __init__(self, problem: PlanningProblem, floor: MultiPolygon, witnesses: Witnesses) -> None:
        self._witnesses, self._floor, self._box = witnesses, Floor(FreeSpace.over(floor)), goal_box(problem)
        self._circular = problem.tree.circular
        self._ranges = [(-pi, pi), *[joint.range for joint in problem.tree.joints]]
        self._goal, self._room = problem.goal_pose[:2], problem.position_tolerance
        self._reach = problem.tree.reach
        known = shapely.union(problem.workspace.envelope, Point(self._goal).buffer(self._room))
        (x0, y0, x1, y1), most = known.bounds, 3.0 * self._reach
        self._everywhere = shapely.box(x0 - most, y0 - most, x1 + most, y1 + most)

    def ranges(self, near: float) -> tuple[Intervals, Intervals]:
        """The ranges of all axes, and what is near the goal, up to an axis with nothing near it.

        Where a circular axis has a goal, its range is the turn that begins with what is near the goal.
        """
        whole, goal = list[Interval](), list[Interval]()
        for (low, high), (lower, upper), circular in zip(
            self._box, self._ranges, self._circular, strict=True
        ):
            if circular and high - low < 2.0 * pi:
                lower = low - near
                upper = float(np.nextafter(lower + 2.0 * pi, lower))
            whole.append((lower, upper))
            if len(goal) + 1 == len(whole) and low <= high:
                goal.append((max(low - near, lower), min(high + near, upper)))
        return tuple(whole), tuple(goal)

    def near_goal(self, box: Intervals, goal: Intervals) -> OverSlice | None:
        """A slice about a part of the goal; None if not all positions are in collision in all of it."""
        ends = zip(box, self._box, goal, strict=True)
        intervals = tuple(
            (near[0] if own[0] == all_[0] else own[0], near[1] if own[1] == all_[1] else own[1])
            for own, all_, near in ends
        )
        overlaps = self._witnesses.overlaps(intervals)
        if overlaps:
            return OverSlice(*self._witnesses.ends(intervals), overlaps, ())
        sweeps = self._witnesses.inner_sweeps(intervals, 0.0)
        left_out = self._left_out(sweeps)
        if left_out is None:
            return None
        cell = OverCell(True, Polygon(self._everywhere.exterior, [left_out]))
        return OverSlice(*self._witnesses.ends(intervals), sweeps, (cell,))

    def rest(self, whole: Intervals, goal: Intervals) -> list[OverSlice] | None:
        """Slices of all else, each with a piece that holds a polygon; None if such slices are too small."""
        left, found = list(_around(whole, goal)), list[OverSlice]()
        for _ in range(MOST_SLICES):
            if not left:
                return found
            intervals = left.pop()
            sweeps = self._witnesses.inner_sweeps(intervals, 0.0)
            if sweeps:
                cell = OverCell(True, self._everywhere)
                found.append(OverSlice(*self._witnesses.ends(intervals), sweeps[:1], (cell,)))
            else:
                widths = [upper - lower for lower, upper in intervals]
                left.extend(halves(intervals, widths.index(max(widths))))
        return None

    def _left_out(self, sweeps: Sequence[Witness]) -> FloatArray | None:
        """A polygon about the goal's positions, all of which the sweeps forbid; None if they do not by a bit.

        Its corners lie halfway between the disc of the goal's positions and the nearest that is left free.
        """
        try:
            free = self._floor.not_forbidden(sweeps)
        except FAILURES:
            return None
        depth = min([-float(region.depths(self._goal[None])[0]) for region in free], default=np.inf)
        radius = self._room + min(0.5 * (depth - self._room), self._reach, EXTRA_FLOOR)
        for corners in CORNERS:
            if depth - self._room > LEAST_DEPTH and radius * cos(pi / corners) > self._room + TINY:
                polygon: FloatArray = radius * normals(np.linspace(0.0, 2.0 * pi, corners, endpoint=False))
                return self._goal + polygon
        return None


def _around(whole: Intervals, goal: Intervals) -> Iterator[Intervals]:
    """Boxes of all that is not near the goal: axis by axis below it and above it, near it on axes before."""
    for axis, (low, high) in enumerate(whole):
        before, after = goal[:axis], whole[axis + 1 :]
        if axis == len(goal):
            yield (*before, (low, high), *after)
            return
        for ends in ((low, goal[axis][0]), (goal[axis][1], high)):
            if ends[0] < ends[1]:
                yield (*before, ends, *after)


ALL_BUT_TOUCHING = 1e-5
"""Bodies that are nearer to a wall than this all but touch it [m]."""

MOST_SWEPT = 128
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
                if hull.distance(problem.workspace.boundary) - shape.radius < ALL_BUT_TOUCHING:
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
    for made in range(1, MOST_SWEPT + 1):
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
    return [], MOST_SWEPT


def _held(regions: list[Region], question: PlanningProblem) -> bool:
    return any(region.near(question.goal_pose[:2], question.position_tolerance) for region in regions)
