"""The plan to execute: the path is covered with other boxes, so that the transport takes less time."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from shapely.errors import ShapelyError

from coop_drake.answers.plan import Plan
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, PlanError, StallError
from coop_drake.geometry.passage import PassageFinder
from coop_drake.laws import GainSet
from coop_drake.planning.boxes.channel import Channel, CoveredPath
from coop_drake.planning.execution.channel_ends import check_ends, goal_intervals, turned_to_start
from coop_drake.planning.execution.targets import choose_targets
from coop_drake.planning.execution.transitions import Progress, make_plan
from coop_drake.planning.improvement.path_covering import cover_path
from coop_drake.tree.pose import FloatArray

__all__ = ["quickest_plan"]


def quickest_plan(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    *,
    gain_set_name: str,
    progress: Progress | None = None,
) -> Plan:
    """Make a plan along the path of a search's result, with other boxes if these can be found.

    Args:
        problem: What was asked.
        found: The channel that a search found, or a path that boxes cover.
        gain_set: Gains, fixed or to be scheduled.
        gain_set_name: Name under which the scenario knows them.
        progress: Called with a phase and the fraction of it that is done.

    Raises:
        GeometryError: If the boxes that the search found are needed and their polygons cannot be made.
        PlanError: If the channel does not join the start to the goal.
        StallError: If a passage is too narrow or too slow to be executed; names it.
    """
    if isinstance(found, Channel):
        found = turned_to_start(found, problem.start[2])
        check_ends(problem, found)
    path = found.path if found.path is not None else path_through(problem, found)
    if progress is not None:
        progress("choosing boxes", 0.0)
    better = cover_path(problem, path, found.margin, gain_set)
    if better is not None:
        try:
            return make_plan(
                problem, better.channel, gain_set, gain_set_name=gain_set_name, targets=better.targets,
                progress=progress,
            )  # fmt: skip
        except (GeometryError, PlanError, StallError, ShapelyError):
            # The boxes that the search found are proved free too, and their passages may be wider.
            pass
    channel = found if isinstance(found, Channel) else found.channel()
    return make_plan(problem, channel, gain_set, gain_set_name=gain_set_name, progress=progress)


def path_through(problem: PlanningProblem, channel: Channel) -> FloatArray:
    """A path along the widest passages of a channel's boxes; angles move evenly from overlap to overlap.

    Args:
        problem: What was asked.
        channel: The boxes, theta turned to the start.

    Returns:
        Free configurations from start to goal, theta unwrapped, shape (m, 3 + n).
    """
    targets = choose_targets(channel, problem.start[:2], problem.goal_pose[:2])
    points = [problem.start[:2], *targets]
    samples, axes = [problem.start], problem.start[2:]
    for index, (box, (entry, target)) in enumerate(zip(channel.boxes, pairwise(points), strict=True)):
        lower, upper = goal_intervals(problem, channel, index)
        last = index + 1 == len(channel.boxes)
        aim = np.clip(axes, lower, upper) if last else 0.5 * (lower + upper)
        if last:
            aim[0] = channel.goal_angle
        passage = PassageFinder(box.polygon).find(entry, target)
        corners = shapely.get_coordinates(passage.path)
        at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
        fractions = at / at[-1] if at[-1] > 0.0 else np.linspace(0.0, 1.0, len(at))
        samples += [
            np.array([*corner, *(axes + s * (aim - axes))])
            for corner, s in zip(corners, fractions, strict=True)
        ]
        axes = aim
    return np.array(samples)
