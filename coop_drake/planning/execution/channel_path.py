"""A path through the boxes of a channel that was found without one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.passage import PassageFinder
from coop_drake.planning.boxes.channel import Channel
from coop_drake.planning.execution.channel_ends import goal_intervals, goal_values
from coop_drake.planning.execution.targets import choose_targets
from coop_drake.tree.pose import FloatArray


def path_through(
    problem: PlanningProblem, channel: Channel, targets: Sequence[FloatArray] | None = None
) -> FloatArray:
    """A path along the widest passages of a channel's boxes; angles move evenly from overlap to overlap.

    Args:
        problem: What was asked.
        channel: The boxes, theta turned to the start.
        targets: Points at which each box is left, the last one the goal; chosen to be quick if not given.

    Returns:
        Free configurations from start to goal, circular axes unwrapped, shape (m, 3 + n).
    """
    if targets is None:
        targets = choose_targets(channel, problem.start[:2], problem.goal_pose[:2])
    samples, axes = [problem.start], problem.start[2:]
    entries = (problem.start[:2], *targets[:-1])
    for index, (box, entry, target) in enumerate(zip(channel.boxes, entries, targets, strict=True)):
        lower, upper = goal_intervals(problem, channel, index)
        aim = 0.5 * (lower + upper)
        if index + 1 == len(channel.boxes):
            goals = goal_values(problem, channel.goal_angle, aim)
            nearest = np.clip(axes, lower, upper)
            aim = np.array(
                [near if goal is None else goal for near, goal in zip(nearest, goals, strict=True)]
            )
        corners = shapely.get_coordinates(PassageFinder(box.polygon).find(entry, target).path)
        at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
        fractions = at / at[-1] if at[-1] > 0.0 else np.linspace(0.0, 1.0, len(at))
        turned = axes + fractions[1:, None] * (aim - axes)
        samples += list(np.hstack((corners[1:], turned)))
        axes = aim
    return np.array(samples)
