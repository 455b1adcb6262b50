"""Relaxations: the same question with fewer robots or a disc; if one is infeasible, the question is too."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.answers.limits import TeamLimits
from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.component_tree import Component, ComponentTree, ConvexShape

POLE_TOLERANCE = 1e-4
"""Accuracy of the radius of an inscribed disc, unless another one is asked for [m]."""


def relaxed(problem: PlanningProblem, robots: Collection[int]) -> tuple[PlanningProblem, tuple[int, ...]]:
    """The question with only some of the robots.

    Args:
        problem: The whole question.
        robots: Robots whose arms and bases are kept; bodies welded to the object are kept in any case.

    Returns:
        The relaxed question, and for each of its joints the index of that joint in the whole q.
    """
    tree = problem.tree
    kept = [
        index
        for index, component in enumerate(tree.components)
        if component.joint is None or component.joint.robot in robots
    ]
    joints = [joint.index for joint in tree.joints if joint.robot in robots]
    components = tuple(_renumbered(tree.components[index], kept, joints) for index in kept)
    question = replace(
        problem,
        tree=ComponentTree(components, tree.unchecked_pairs),
        start=np.concatenate((problem.start[:3], problem.start[3:][joints])),
        goal_joints=tuple(problem.goal_joints[index] for index in joints),
        joint_tolerance=np.broadcast_to(problem.joint_tolerance, len(tree.joints))[joints],
        limits=TeamLimits(),
    )
    return question, tuple(joints)


def _renumbered(component: Component, kept: list[int], joints: list[int]) -> Component:
    if component.joint is None or component.parent is None:
        return component
    joint = replace(component.joint, index=joints.index(component.joint.index))
    return replace(component, parent=kept.index(component.parent), joint=joint)


def inscribed_disc(shape: ConvexShape, tolerance: float = POLE_TOLERANCE) -> ConvexShape:
    """The largest disc inside a convex shape; of radius zero for a shape without interior.

    Args:
        shape: The shape.
        tolerance: A larger disc may be larger by this much [m].
    """
    if len(shape.vertices) < 3:
        return ConvexShape(shape.vertices.mean(axis=0, keepdims=True), shape.radius)
    ring = Polygon(shape.vertices)
    pole = shapely.maximum_inscribed_circle(ring, tolerance=tolerance)
    centre = np.asarray(pole.coords[0])
    return ConvexShape(centre[None, :], float(ring.exterior.distance(Point(centre))) + shape.radius)
