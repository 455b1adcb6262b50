"""The plan to execute: boxes laid anew along the channel's way, so that the transport takes little time."""

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
from coop_drake.planning.boxes.channel import Channel, Way
from coop_drake.planning.boxes.shortcuts import without_detours
from coop_drake.planning.execution.channel_ends import check_ends, goal_intervals, turned_to_start
from coop_drake.planning.execution.targets import choose_targets
from coop_drake.planning.execution.transitions import Progress, make_plan
from coop_drake.planning.improvement.path_covering import resliced
from coop_drake.tree.pose import FloatArray

__all__ = ["quickest_plan"]


def quickest_plan(
    problem: PlanningProblem,
    found: Channel | Way,
    gain_set: GainSet,
    *,
    gain_set_name: str,
    progress: Progress | None = None,
) -> Plan:
    """Make a channel ready to be executed, with other boxes along its way where they can be had.

    Args:
        problem: What was asked.
        found: The boxes that a search found, or a path that boxes cover.
        gain_set: Gains, fixed or to be scheduled.
        gain_set_name: Name under which the scenario knows them.
        progress: Called with a stage and the share of it that is done.

    Raises:
        GeometryError: If the boxes that cover the path cannot be made, where they are needed.
        PlanError: If the channel does not join the start to the goal.
        StallError: If a passage is too narrow or too slow to be executed; names it.
    """
    if isinstance(found, Channel):
        found = turned_to_start(found, problem.start[2])
        check_ends(problem, found)
    way = found.path if found.path is not None else way_through(problem, found)
    if progress is not None:
        progress("choosing boxes", 0.0)
    better = resliced(problem, way, found.margin, gain_set)
    if better is not None:
        try:
            return make_plan(
                problem, better.channel, gain_set, gain_set_name=gain_set_name, targets=better.targets,
                progress=progress,
            )  # fmt: skip
        except (GeometryError, PlanError, StallError, ShapelyError):
            # The boxes that the search found are as good a proof, and their necks are other ones.
            pass
    channel = found if isinstance(found, Channel) else found.channel()
    return make_plan(problem, channel, gain_set, gain_set_name=gain_set_name, progress=progress)


def way_through(problem: PlanningProblem, channel: Channel) -> FloatArray:
    """Configurations along the widest passages of the boxes, axes turning evenly from overlap to overlap.

    Args:
        problem: What was asked.
        channel: Boxes, theta turned to the start.

    Returns:
        Free configurations from start to goal, theta unwrapped, shape (m, 3 + n).
    """
    channel = without_detours(channel)
    targets = choose_targets(channel, problem.start[:2], problem.goal_pose[:2])
    points = [problem.start[:2], *targets]
    way, axes = [problem.start], problem.start[2:]
    for index, (box, (entry, target)) in enumerate(zip(channel.boxes, pairwise(points), strict=True)):
        lower, upper = goal_intervals(problem, channel, index)
        last = index + 1 == len(channel.boxes)
        aim = np.clip(axes, lower, upper) if last else 0.5 * (lower + upper)
        if last:
            aim[0] = channel.goal_angle
        path = PassageFinder(box.polygon).find(entry, target).path
        corners = shapely.get_coordinates(path)
        at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
        share = at / at[-1] if at[-1] > 0.0 else np.linspace(0.0, 1.0, len(at))
        way += [
            np.array([*corner, *(axes + s * (aim - axes))]) for corner, s in zip(corners, share, strict=True)
        ]
        axes = aim
    return np.array(way)
