"""Small questions with answers of either kind, and ways to tamper with what is written down about them."""

import json
from copy import deepcopy

import numpy as np
from shapely import Polygon, box, normalize, union_all

from coop_drake.answers.document import content_digest
from coop_drake.answers.problem import PlanningProblem
from coop_drake.laws import ScheduledGains
from tests.support.cases import team_tree

GAINS = {"scheduled": ScheduledGains()}
PILLAR = [(2.8, 1.0), (3.2, 1.0), (3.2, 1.4), (2.8, 1.4)]


def room_with_pillar(robots=1, pillar=PILLAR):
    """From one end of a room to the other past a pillar; the joint has a goal."""
    return PlanningProblem(
        workspace=Polygon(box(0.0, 0.0, 6.0, 5.0).exterior.coords, [pillar]),
        tree=team_tree(robots, 1),
        start=np.array([1.6, 2.5, 0.2, *[0.0] * robots]),
        goal_pose=np.array([4.2, 2.6, 0.9]),
        goal_joints=(0.3, *[None] * (robots - 1)),
    )


def bent_corridor(width, goal=(5.1, 5.0, 0.1), robots=1):
    """Two rooms joined by a corridor of some width with a right-angled bend."""
    up, right = box(0.9, 2.3, 0.9 + width, 5.3), box(0.9, 5.3 - width, 4.0, 5.3)
    floor = union_all([box(0.0, 0.0, 2.6, 2.4), up, right, box(3.9, 3.8, 6.3, 6.2)])
    return PlanningProblem(
        workspace=normalize(floor),
        tree=team_tree(robots, 1),
        start=np.array([0.9, 1.1, 0.0, *[0.0] * robots]),
        goal_pose=np.array(goal),
        goal_joints=(None,) * robots,
    )


def entry_at(document, way):
    """What stands at the end of a way."""
    for step in way:
        document = document[step]
    return document


def changed(document, way, value):
    """The document with another value at the end of a way."""
    document = deepcopy(document)
    entry_at(document, way[:-1])[way[-1]] = value
    return document


def write(document, path, *, signed):
    """Write a document, with the digest of its content if it is to be signed again."""
    if signed:
        document = {**document, "digest": content_digest(document)}
    path.write_text(json.dumps(document))
    return path
