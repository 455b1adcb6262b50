"""Questions of two arms, or two discs, that are in each other's way."""

from __future__ import annotations

from math import pi

import numpy as np
from shapely import box

from coop_drake.answers import PlanningProblem
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import PlanarPose

__all__ = ["crossing_question", "discs_in_a_corridor"]

REACH, HALF_WIDTH = 0.6, 0.03
"""How far the arms reach from their joints, half their width [m]."""


def crossing_question(seed: int, *, crossed: str) -> PlanningProblem:
    """A bar with two arms in a hall; turned inwards, the first one crosses the other at all of its angles.

    Args:
        seed: The same seed gives the same question.
        crossed: Where the first arm is turned inwards: at the ``start``, at the ``goal``, or ``nowhere``.
    """
    random = np.random.default_rng(seed)
    apart, inwards, outwards = random.uniform((0.1, 0.5, 0.6), (0.15, 0.7, 0.9)).tolist()
    other = (0.2, float(random.uniform(0.5, 0.9)))
    limits, arms = ((-1.0, 1.0), other), []
    for k, (low, high) in enumerate(limits):
        joint = TreeJoint(
            f"joint_{k}", "revolute", k, k, PlanarPose(0.2, (apart, -apart)[k]), 1.0, (1.0, 0.0), low, high
        )
        arms.append(
            Component(f"arm_{k}", 0, joint, (Body(f"arm_{k}", k, (_plate(0.0, REACH, HALF_WIDTH),)),))
        )
    bar = Component("bar", None, None, (Body("bar", None, (_plate(-0.2, 0.2, 0.2),)),))
    tree = ComponentTree((bar, *arms), frozenset({("arm_0", "bar"), ("arm_1", "bar")}))
    ends = random.uniform((1.1, 1.1, -pi), (3.9, 2.9, pi), (2, 3))
    first = -inwards if crossed == "start" else outwards
    goal = -inwards if crossed == "goal" else outwards
    return PlanningProblem(
        box(0, 0, 5, 4), tree, np.array([*ends[0], first, other[0]]), ends[1], (goal, None)
    )


def discs_in_a_corridor(width: float) -> PlanningProblem:
    """Two discs of 0.3 m whose centres may be 0.5 m to 0.7 m apart shall change their order.

    Args:
        width: Of the corridor [m]; where there is no way, walls squeeze the discs together.
    """
    joint = TreeJoint("slide", "prismatic", 0, 0, PlanarPose(), 1.0, (1.0, 0.0), 0.5, 0.7)
    disc = ConvexShape(np.zeros((1, 2)), 0.3)
    components = (
        Component("object", None, None, (Body("first", None, (disc,)),)),
        Component("slider", 0, joint, (Body("second", 0, (disc,)),)),
    )
    start, goal = np.array([3.0, 0.5, 0.0, 0.65]), np.array([3.0, 0.5, pi])
    tree = ComponentTree(components, frozenset())
    return PlanningProblem(box(0.0, 0.0, 6.0, width), tree, start, goal, (None,))


def _plate(x_lower: float, x_upper: float, y: float) -> ConvexShape:
    return ConvexShape(np.array([[x_lower, -y], [x_upper, -y], [x_upper, y], [x_lower, y]]))
