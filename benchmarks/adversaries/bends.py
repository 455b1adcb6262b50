"""Questions of a rod before a bend: mostly too tight, so that proofs need slices of angles and of a joint."""

from __future__ import annotations

from math import pi
from typing import Literal

import numpy as np
import shapely
from shapely import Polygon, box, union_all

from coop_drake.answers import PlanningProblem
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import PlanarPose

__all__ = ["Carrier", "bend_question"]

Carrier = Literal["object", "revolute", "prismatic"]

LONGEST = 2.0 * 2.0**0.5
"""A thin rod that turns a right-angled corner is at most so many widths of the corridors long [-]."""


def bend_question(seed: int, carrier: Carrier, *, in_corridor: bool = False) -> PlanningProblem:
    """Two rooms that a corridor with a right-angled bend joins, turned and anywhere; a rod is to go through.

    Args:
        seed: The same seed gives the same question.
        carrier: Whether the rod is the object, or hangs at the object, a small disc, by a joint.
        in_corridor: Whether the goal lies in the first half of the corridor, where the rod all but fits
            at one limit of its joint.
    """
    random = np.random.default_rng(seed)
    length, thick, turn = random.uniform(1.0, 1.6), random.uniform(0.1, 0.2), random.uniform(-pi, pi)
    width = length / LONGEST * random.uniform(0.6, 0.95)
    tree = _rod(carrier, length, thick, random)
    rooms = [box(0.0, 0.0, 2.4, 2.4), box(3.0, 2.0, 5.4, 4.4)]
    ways = [box(0.7, 2.3, 0.7 + width, 2.9 + width), box(0.7, 2.9, 3.1, 2.9 + width)]
    matrix = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    shift = random.uniform(-1.0, 1.0, 2) * 10.0 ** random.uniform(-2.0, 3.0)
    floor = shapely.transform(union_all([*rooms, *ways]), lambda xy: xy @ matrix + shift)
    assert isinstance(floor, Polygon)
    count, goal = len(tree.joints), (0.7 + 0.5 * width, 2.7) if in_corridor else (4.2, 3.2)
    start = np.array([*(np.array([1.2, 1.2]) @ matrix + shift), random.uniform(-pi, pi), *[0.0] * count])
    most = tree.joint_upper.max(initial=0.0) if carrier == "revolute" else 0.0
    aslant = turn + 0.5 * pi + 1.05 * np.arcsin(width / length) + most
    goal_pose = np.array(
        [*(np.array(goal) @ matrix + shift), aslant if in_corridor else random.uniform(-pi, pi)]
    )
    return PlanningProblem(floor, tree, start, goal_pose, (None,) * count)


def _rod(carrier: Carrier, length: float, thick: float, random: np.random.Generator) -> ComponentTree:
    x, y = 0.5 * length, 0.5 * thick
    rod = ConvexShape(np.array([[-x, -y], [x, -y], [x, y], [-x, y]]))
    if carrier == "object":
        return ComponentTree((Component("object", None, None, (Body("object", None, (rod,)),)),), frozenset())
    most = random.uniform(0.05, 0.3 if carrier == "revolute" else 0.2)
    joint = TreeJoint("joint", carrier, 0, 0, PlanarPose(), 1.0, (1.0, 0.0), -most, most)
    disc = Body("object", None, (ConvexShape(np.zeros((1, 2)), 0.6 * thick),))
    arm = Component("arm", 0, joint, (Body("arm", 0, (rod,)),))
    return ComponentTree((Component("object", None, None, (disc,)), arm), frozenset({("object", "arm")}))
