"""A way through a channel, configuration by configuration."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers import PlanningProblem
from coop_drake.geometry.passage import PassageFinder, pole
from coop_drake.planning import Channel
from coop_drake.planning.sampling.sampler import densified
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

__all__ = ["path_through"]


def path_through(problem: PlanningProblem, channel: Channel, step: float) -> FloatArray:
    """Configurations from start to goal, each of them inside a box of the channel.

    It is the path that the boxes were laid along, if there is one. Else, inside a box, the position follows
    the widest passage and the angles turn evenly along it.

    Args:
        problem: The question that the channel answers.
        channel: Boxes that overlap.
        step: How far the team moves at most from one configuration to the next [m].

    Returns:
        Configurations with theta unwrapped, shape (m, 3 + n) [m, rad].
    """
    if channel.path is not None:
        return densified(channel.path, configuration_scale(problem.tree), step)
    targets = [*_handovers(channel), problem.goal_pose[:2]]
    corners = [problem.start]
    for place, (box, target) in enumerate(zip(channel.boxes, targets, strict=True)):
        angles = _angles(problem, channel, place)
        passage = PassageFinder(box.polygon).find(corners[-1][:2], target)
        points = np.asarray(passage.path.coords)
        along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
        share = along[1:] / along[-1] if along[-1] > 0.0 else np.linspace(0.0, 1.0, len(along))[1:]
        turned = corners[-1][2:] + share[:, None] * (angles - corners[-1][2:])
        corners += list(np.hstack((points[1:], turned)))
    path = np.array(corners)
    moved = np.concatenate(([True], [bool((a != b).any()) for a, b in pairwise(path)]))
    return densified(path[moved], configuration_scale(problem.tree), step)


def _handovers(channel: Channel) -> list[FloatArray]:
    """A point with much room in every overlap of consecutive boxes."""
    points = []
    for one, other in pairwise(channel.boxes):
        shared = shapely.get_parts(shapely.intersection(one.polygon, other.polygon))
        areas = [part for part in shared if isinstance(part, Polygon)]
        points.append(max((pole(area) for area in areas), key=lambda found: found[1])[0])
    return points


def _angles(problem: PlanningProblem, channel: Channel, place: int) -> FloatArray:
    """Angles at which box ``place`` is left: in the middle of what it shares with the next."""
    box = channel.boxes[place]
    if place + 1 < len(channel.boxes):
        after = channel.boxes[place + 1]
        lower, upper = np.maximum(box.lower, after.lower), np.minimum(box.upper, after.upper)
        middle: FloatArray = 0.5 * (lower + upper)
        return middle
    middle = 0.5 * (box.lower + box.upper)
    goals = (channel.goal_angle, *problem.goal_joints)
    return np.array([m if goal is None else goal for m, goal in zip(middle, goals, strict=True)])
