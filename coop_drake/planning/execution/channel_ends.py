"""The ends of a channel: checked, turned to the start; and the goal intervals of each of its boxes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, tau

import numpy as np
from shapely import Point

from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.errors import PlanError
from coop_drake.planning.boxes.channel import Channel
from coop_drake.tree.circles import nearest_turn
from coop_drake.tree.pose import FloatArray

GOAL_FRACTION = 0.9
"""Fraction of the goal's intervals that a plan ends in, so that it is within tolerance at their edges [-]."""

Bounds = tuple[FloatArray, FloatArray]
"""Lower and upper ends of (theta, q...), shape (1 + n,) each [rad, m]."""


def goal_values(problem: PlanningProblem, goal_angle: float, near: FloatArray) -> tuple[float | None, ...]:
    """Values of (theta, q...) at the goal, None for joints that are free there.

    Args:
        problem: What was asked.
        goal_angle: The goal's theta, unwrapped [rad].
        near: Values of (theta, q...) that the goals of joints without limits are turned to, shape (1 + n,).
    """
    joints = zip(problem.tree.joints, problem.goal_joints, near[1:].tolist(), strict=True)
    turned = (
        value + nearest_turn(goal - value) if joint.circular and goal is not None else goal
        for joint, goal, value in joints
    )
    return (goal_angle, *turned)


def final_intervals(problem: PlanningProblem, values: Sequence[float | None]) -> Bounds:
    """Intervals of (theta, q...) in which the goal is reached; infinite for joints that are free there.

    Args:
        problem: What was asked.
        values: The values there, see ``goal_values``.
    """
    goals = (float(problem.goal_pose[2]), *problem.goal_joints)
    lower, upper = np.full(len(goals), -inf), np.full(len(goals), inf)
    for axis, ((low, high), goal, value) in enumerate(zip(goal_box(problem), goals, values, strict=True)):
        if goal is not None and value is not None:
            spare, turned = 0.5 * (1.0 - GOAL_FRACTION) * (high - low), value - goal
            lower[axis], upper[axis] = low + spare + turned, high - spare + turned
    return lower, upper


def goal_intervals(problem: PlanningProblem, channel: Channel, index: int) -> Bounds:
    """Intervals of (theta, q...) to reach in a box: its overlap with the next box or with the goal.

    Raises:
        PlanError: If they do not overlap; names the box and the axis.
    """
    lower, upper = channel.boxes[index].lower.copy(), channel.boxes[index].upper.copy()
    if index + 1 < len(channel.boxes):
        following = channel.boxes[index + 1]
        lower, upper = np.maximum(lower, following.lower), np.minimum(upper, following.upper)
    else:
        goals = final_intervals(problem, goal_values(problem, channel.goal_angle, 0.5 * (lower + upper)))
        lower, upper = np.maximum(lower, goals[0]), np.minimum(upper, goals[1])
    if not (lower < upper).all():
        axis = int(np.argmin(lower < upper))
        other = "the next cell" if index + 1 < len(channel.boxes) else "the goal"
        raise PlanError(
            f"cell {index}: on axis {axis} it shares no interval with {other}: the larger lower end "
            f"{lower[axis]} is not below the smaller upper end {upper[axis]}"
        )
    return lower, upper


def turned_to_start(problem: PlanningProblem, channel: Channel) -> Channel:
    """Shift circular axes of all boxes by full turns so that the first one holds the start's angles."""
    first = channel.boxes[0]
    turns = np.rint((problem.start[2:] - 0.5 * (first.lower + first.upper)) / tau)
    shift = np.where(problem.tree.circular, turns * tau, 0.0)
    boxes = tuple(replace(box, lower=box.lower + shift, upper=box.upper + shift) for box in channel.boxes)
    path = None if channel.path is None else channel.path + np.concatenate([[0.0, 0.0], shift])
    return replace(channel, boxes=boxes, goal_angle=channel.goal_angle + shift[0], path=path)


def check_ends(problem: PlanningProblem, channel: Channel) -> None:
    """Refuse a channel whose first box does not hold the start, or whose last one does not hold the goal.

    Raises:
        PlanError: Names the end and the box.
    """
    first, last = channel.boxes[0], channel.boxes[-1]
    start, goal = problem.start[2:], channel.goal_angle
    if not first.polygon.contains(Point(problem.start[:2])):
        raise PlanError("the start's position lies outside the first cell")
    if not ((first.lower < start) & (start < first.upper)).all():
        raise PlanError(
            f"the start's angles {start} lie outside the first cell's [{first.lower}, {first.upper}]"
        )
    if not last.polygon.contains(Point(problem.goal_pose[:2])):
        raise PlanError("the goal's position lies outside the last cell")
    if not last.lower[0] <= goal <= last.upper[0]:
        raise PlanError(
            f"the goal's angle {goal} lies outside the last cell's [{last.lower[0]}, {last.upper[0]}]"
        )
