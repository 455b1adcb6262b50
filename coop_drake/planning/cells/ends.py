"""Where a transport ends within its goal, if not in its middle: that is in collision, or beyond a limit."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.geometry.convex import normals
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.cells import Region
from coop_drake.tree.circles import nearest_turn
from coop_drake.tree.pose import FloatArray

LEAST_SHARE = 0.1
"""Share of a tolerance about an end that a cell leaves at least, so that a team can come to rest [-]."""

_FAN = (
    np.array([0.25, 0.5, 0.75])[:, None, None] * normals(np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False))
).reshape(-1, 2)
"""Positions within a tolerance of 1 that are tried, shape (48, 2) [-]."""


def end_in(problem: PlanningProblem, intervals: Intervals, region: Region) -> FloatArray | None:
    """A configuration of the goal in a cell that is free, its middle if possible; None if there is no room.

    Args:
        problem: The question.
        intervals: The cell's intervals of (theta, q...).
        region: Its positions.

    Returns:
        z, theta as in the intervals, joints without a goal in the middle of theirs, shape (3 + n,) [m, rad].
    """
    place, values = _place_in(problem, region), list[float]()
    goals, circular = (float(problem.goal_pose[2]), *problem.goal_joints), problem.tree.circular
    for (a, b), (low, high), goal, periodic in zip(
        intervals, goal_box(problem), goals, circular, strict=True
    ):
        middle = 0.5 * (a + b)
        if goal is None:
            values.append(middle)
            continue
        turns = middle + nearest_turn(goal - middle) - goal if periodic else 0.0
        lower, upper = max(a, low + turns), min(b, high + turns)
        if lower <= goal + turns <= upper:
            values.append(goal + turns)
        elif upper - lower >= LEAST_SHARE * (high - low) > 0.0:
            values.append(0.5 * (lower + upper))
    return None if place is None or len(values) < len(intervals) else np.array([*place, *values])


def _place_in(problem: PlanningProblem, region: Region) -> FloatArray | None:
    """The goal's position if a region holds it, else the one within the tolerance that has the most room."""
    goal, room = problem.goal_pose[:2], problem.position_tolerance
    if region.holds(goal):
        return goal
    if not region.near(goal, room):
        return None
    places = goal + room * _FAN
    left = np.minimum(region.depths(places), room - np.hypot(*(places - goal).T))
    best = int(np.argmax(left))
    return places[best] if left[best] >= LEAST_SHARE * room else None
