"""A blocked goal as a proof: slices of one cell that leaves out positions about the goal, in collision."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import pi

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof, OverCell, OverSlice, Witness
from coop_drake.geometry.swept_tree import Interval, Intervals
from coop_drake.planning.cells.slices import halves
from coop_drake.planning.proofs.witnesses import Witnesses

NEAR_GOAL = (1e-3, 1e-5, 1e-7)
"""Slices about the goal reach so far from the goals of theta and joints, in the order tried [rad or m]."""

LEAST_DEPTH = 1e-8
"""A goal less deep inside the positions that are in collision counts as touching only [m]."""

MOST_SLICES = 1024
"""Slices away from the goal that are made at most, until in each a piece is known to hold a polygon [-]."""


def blocked_goal_proof(
    problem: PlanningProblem, boxes: Sequence[Intervals], witnesses: Witnesses
) -> InfeasibilityProof | None:
    """Write down that the team is in collision at its goal.

    Slices about the goal have one cell, which leaves out positions about the goal's; all others have one cell
    that leaves out nothing.

    Args:
        problem: The question with the robots that are kept.
        boxes: Boxes that cover the free joints' limits, with the goal's theta and joints on the other axes:
            in each of them the team is in collision at the goal's position.
        witnesses: Makes what shows collisions.

    Returns:
        The proof, None if the team is not known to be in collision by more than a touch.
    """
    writer = _Writer(problem, witnesses)
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
    def __init__(self, problem: PlanningProblem, witnesses: Witnesses) -> None:
        self._problem, self._witnesses, self._floor = problem, witnesses, problem.workspace
        self._reach = problem.tree.reach
        known = shapely.union(self._floor.envelope, Point(problem.goal_pose[:2]))
        (x0, y0, x1, y1), most = known.bounds, 3.0 * self._reach
        self._everywhere = shapely.box(x0 - most, y0 - most, x1 + most, y1 + most)
        rings = (self._floor.exterior, *self._floor.interiors)
        self._walls = [pair for ring in rings for pair in zip(ring.coords[:-1], ring.coords[1:], strict=True)]

    def ranges(self, near: float) -> tuple[Intervals, Intervals]:
        """The ranges of all axes, and what is near the goal, up to an axis with nothing near it.

        Where a circular axis has a goal, its range is the turn that begins with what is near the goal.
        """
        joints, whole, goal = self._problem.tree.joints, list[Interval](), list[Interval]()
        aims = (float(self._problem.goal_pose[2]), *self._problem.goal_joints)
        ranges = ((-pi, pi), *(joint.range for joint in joints))
        for (lower, upper), aim, circular in zip(ranges, aims, self._problem.tree.circular, strict=True):
            if circular and aim is not None:
                lower = aim - near
                upper = float(np.nextafter(lower + 2.0 * pi, aim))
            whole.append((lower, upper))
            low, high = (-np.inf, np.inf) if aim is None else (aim - near, aim + near)
            if len(goal) + 1 == len(whole) and max(lower, low) <= min(upper, high):
                goal.append((max(lower, low), min(upper, high)))
        return tuple(whole), tuple(goal)

    def near_goal(self, box: Intervals, goal: Intervals) -> OverSlice | None:
        """A slice about the goal; None if the goal's position is not in collision in all of it."""
        aims = (self._problem.goal_pose[2], *self._problem.goal_joints)
        ends = zip(box, goal, aims, strict=True)
        intervals = tuple(own if aim is None else near for own, near, aim in ends)
        overlaps = self._witnesses.overlaps(intervals)
        if overlaps:
            return OverSlice(*self._witnesses.ends(intervals), overlaps, ())
        sweeps = self._witnesses.inner_sweeps(intervals, 0.0)
        depth = max(map(self._depth, sweeps), default=0.0)
        if depth < LEAST_DEPTH:
            return None
        (x, y), half = self._problem.goal_pose[:2], min(0.5 * depth, self._reach)
        left_out = shapely.box(x - half, y - half, x + half, y + half)
        cell = OverCell(True, Polygon(self._everywhere.exterior, [left_out.exterior]))
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

    def _depth(self, witness: Witness) -> float:
        """How deep the goal's position is in the positions that a polygon forbids, zero outside [m]."""
        goal = self._problem.goal_pose[:2]
        if self._floor.is_empty:
            return float("inf")
        middle = Point(goal + witness.polygon.mean(axis=0))
        depths = [0.0 if self._floor.covers(middle) else self._floor.distance(middle)]
        held = Polygon(goal + witness.polygon)
        for wall in self._walls:
            if held.intersects(shapely.LineString(wall)):
                corners = (np.array(wall)[:, None] - witness.polygon).reshape(-1, 2)
                forbidden = shapely.MultiPoint(corners).convex_hull
                inside = forbidden.contains(Point(goal))
                depths.append(forbidden.boundary.distance(Point(goal)) if inside else 0.0)
        return max(depths)


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
