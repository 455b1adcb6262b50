"""Exact checks of a channel: sampled configurations of every box, and how consecutive boxes overlap."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Point, maximum_inscribed_circle

from coop_drake.answers.problem import PlanningProblem
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.channel import Channel, NoChannel
from coop_drake.planning.search import find_channel
from coop_drake.planning.transitions import goal_values
from tests.support.free_positions import FreePositions

_POSITIONS = 200


def sound_channel(problem: PlanningProblem) -> Channel:
    """The channel that is found, after its exact checks."""
    channel, _ = find_channel(problem)
    assert isinstance(channel, Channel)
    assert_channel_is_sound(problem, channel)
    return channel


def no_channel(problem: PlanningProblem, *, proved: bool = True) -> NoChannel:
    """Why no channel is found: it is proved that there is none, or nothing is."""
    answer, _ = find_channel(problem)
    assert isinstance(answer, NoChannel)
    assert answer.proved is proved
    return answer


def assert_channel_is_sound(problem: PlanningProblem, channel: Channel, samples: int = 6) -> None:
    """Start in the first box, goal in the last, overlaps with interior, nothing touched in any box."""
    first, last = channel.boxes[0], channel.boxes[-1]
    assert first.polygon.contains(Point(problem.start[:2]))
    assert np.all(first.lower <= problem.start[2:])
    assert np.all(problem.start[2:] <= first.upper)
    assert last.polygon.contains(Point(problem.goal_pose[:2]))
    assert last.lower[0] < channel.goal_angle < last.upper[0]
    assert np.isclose(np.remainder(channel.goal_angle - problem.goal_pose[2] + np.pi, 2 * np.pi), np.pi)
    values = goal_values(problem, channel.goal_angle, 0.5 * (last.lower + last.upper))
    for joint, value, asked in zip(problem.tree.joints, values[1:], problem.goal_joints, strict=True):
        low, high = last.lower[1 + joint.index], last.upper[1 + joint.index]
        assert value is None or low <= value <= high
        turned = value is not None and np.isclose(np.remainder(value - asked + np.pi, 2 * np.pi), np.pi)
        assert value == asked or (joint.circular and turned)
    for one, other in zip(channel.boxes[:-1], channel.boxes[1:], strict=True):
        assert np.all(np.minimum(one.upper, other.upper) - np.maximum(one.lower, other.lower) > 1e-6)
        assert maximum_inscribed_circle(one.polygon.intersection(other.polygon), tolerance=1e-4).length > 1e-4
    for number, box in enumerate(channel.boxes):
        assert np.all(box.lower[1:] >= problem.tree.joint_lower)
        assert np.all(box.upper[1:] <= problem.tree.joint_upper)
        assert_box_is_free(problem, box, samples, number)


def assert_box_is_free(problem: PlanningProblem, box: FreeBox, samples: int, seed: int) -> None:
    """Nothing is touched at the box's corners, along its rim or inside, at angles that favour its ends."""
    random = np.random.default_rng(seed)
    shapely.prepare(box.polygon)
    inside = random.uniform(box.polygon.bounds[:2], box.polygon.bounds[2:], (_POSITIONS, 2))
    positions = np.concatenate(
        (shapely.get_coordinates(box.polygon), inside[shapely.contains_xy(box.polygon, inside)])
    )
    for k in range(samples):
        share = random.random(len(box.lower))
        angles = box.lower + (np.rint(share) if k % 2 else share) * (box.upper - box.lower)
        assert FreePositions(problem.tree, problem.workspace, angles).free(positions).all()
