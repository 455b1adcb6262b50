"""Paths of the whole team: one through a channel, and a proof that a given one is free."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers import PlanningProblem
from coop_drake.errors import GeometryError
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.passage import PassageFinder, pole
from coop_drake.geometry.swept_tree import SweptTree
from coop_drake.planning import Channel
from coop_drake.planning.boxes.certify import Certifier
from coop_drake.planning.questions.margins import exact_footprint, marginal_workspace
from coop_drake.planning.sampling.sampler import densified
from coop_drake.tree.levers import configuration_scale
from coop_drake.tree.pose import FloatArray

__all__ = ["is_free", "path_through"]


def is_free(problem: PlanningProblem, path: FloatArray) -> tuple[bool, int]:
    """Try to prove a path free at margin zero, by covering it with free boxes.

    Args:
        problem: The problem.
        path: Configurations from start to goal, theta unwrapped, shape (m, 3 + n) [m, rad].

    Returns:
        Whether the path is proved free (a failure proves nothing), and how many boxes were tried.
    """
    if not problem.workspace.contains(exact_footprint(problem.tree, path[0])):
        return False, 0  # Boxes show that a path meets no wall, but not on which side of it the path begins.
    swept = SweptTree(problem.tree)
    try:
        workspace, scale = marginal_workspace(problem, 0.0), configuration_scale(problem.tree)
        certifier = Certifier(swept, BodyPairs(swept), workspace, scale, 0.0)
        proved = certifier.boxes(path, longest=True, smallest=True) is not None
    except GeometryError:
        return False, 0
    return proved, certifier.trials


def path_through(problem: PlanningProblem, channel: Channel, step: float) -> FloatArray:
    """Configurations from start to goal, each of them inside a box of the channel.

    It is the path that the boxes were laid along, if there is one. Otherwise the position follows the widest
    path in every box while the angles change evenly along it.

    Args:
        problem: The problem that the channel solves.
        channel: Boxes of which each overlaps the next.
        step: How far the team moves at most from one configuration to the next [m].

    Returns:
        Configurations with theta unwrapped, shape (m, 3 + n) [m, rad].
    """
    scale = configuration_scale(problem.tree)
    if channel.path is not None:
        return densified(channel.path, scale, step)
    targets = [*_handovers(channel), problem.goal_pose[:2]]
    corners = [problem.start]
    for place, (box, target) in enumerate(zip(channel.boxes, targets, strict=True)):
        angles = _angles(problem, channel, place)
        points = np.asarray(PassageFinder(box.polygon).find(corners[-1][:2], target).path.coords)
        along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
        fraction = along[1:] / along[-1] if along[-1] > 0.0 else np.linspace(0.0, 1.0, len(along))[1:]
        turned = corners[-1][2:] + fraction[:, None] * (angles - corners[-1][2:])
        corners += list(np.hstack((points[1:], turned)))
    path = np.array(corners)
    moved = np.concatenate(([True], (np.diff(path, axis=0) != 0.0).any(axis=1)))
    return densified(path[moved], scale, step)


def _handovers(channel: Channel) -> list[FloatArray]:
    """A point with much clearance in every overlap of consecutive boxes."""
    points = []
    for one, other in pairwise(channel.boxes):
        shared = shapely.get_parts(shapely.intersection(one.polygon, other.polygon))
        areas = [part for part in shared if isinstance(part, Polygon)]
        points.append(max((pole(area) for area in areas), key=lambda found: found[1])[0])
    return points


def _angles(problem: PlanningProblem, channel: Channel, place: int) -> FloatArray:
    """(theta, q...) at which a box is left: in the middle of what it shares with the next, or the goal."""
    box = channel.boxes[place]
    after = channel.boxes[min(place + 1, len(channel.boxes) - 1)]
    middle: FloatArray = 0.5 * (np.maximum(box.lower, after.lower) + np.minimum(box.upper, after.upper))
    if after is not box:
        return middle
    goals = (channel.goal_angle, *problem.goal_joints)
    return np.array([m if goal is None else goal for m, goal in zip(middle, goals, strict=True)])
