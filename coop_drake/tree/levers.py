"""The metric between configurations: how far the team moves per unit of each axis; and the usual size."""

from __future__ import annotations

from math import hypot, log2

import numpy as np

from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray

# The unit of length in which a team has the usual size.

_USUAL_SIZE = 0.25
"""Mean radius of a usual team's convex pieces [m]; steps and resolutions of the search are meant for it."""

_UNUSUAL = 1.5
"""Octaves of size within which a team counts as usual [-]."""


def usual_unit(tree: ComponentTree) -> float:
    """Length in which a team has the usual size: 1 m unless it is about three times larger or smaller.

    It is a power of two, so that no length is rounded when its unit changes.
    """
    shapes = [shape for component in tree.components for body in component.bodies for shape in body.shapes]
    sizes = [float(np.hypot(*np.ptp(shape.vertices, axis=0))) / 2.0 + shape.radius for shape in shapes]
    size = float(np.mean(sizes)) if sizes else 0.0
    octaves = log2(size / _USUAL_SIZE) if size > 0.0 else 0.0
    return 1.0 if abs(octaves) <= _UNUSUAL else 2.0 ** round(octaves)


# How far the team moves per unit of each axis; the metric between configurations.

_LEAST_LEVER = 0.01
"""A joint that moves no solid body counts this much in distances [m per unit]: it still has to be moved."""


def axis_levers(tree: ComponentTree) -> tuple[float, ...]:
    """Largest distance that any carried point moves per unit of each axis (theta, q...).

    In m/rad for an angle; without a unit for a prismatic joint.
    """
    reaches = [0.0] * len(tree.components)
    levers = [0.0] * (1 + len(tree.joints))
    for index in range(len(tree.components) - 1, -1, -1):
        component = tree.components[index]
        own = max(
            (
                float((shape.vertices**2).sum(axis=1).max() ** 0.5) + shape.radius
                for body in component.bodies
                for shape in body.shapes
            ),
            default=0.0,
        )
        reaches[index] = max(reaches[index], own)
        joint = component.joint
        if joint is None or component.parent is None:
            levers[0] = reaches[index]
            continue
        length = (joint.axis[0] ** 2 + joint.axis[1] ** 2) ** 0.5
        revolute = joint.kind == "revolute"
        levers[1 + joint.index] = reaches[index] if revolute else length
        slide = 0.0 if revolute else length * max(abs(joint.lower), abs(joint.upper))
        offset = (joint.X_PJ.x**2 + joint.X_PJ.y**2) ** 0.5
        reaches[component.parent] = max(reaches[component.parent], offset + slide + reaches[index])
    return tuple(levers)


def configuration_scale(tree: ComponentTree) -> FloatArray:
    """What a unit of each axis of z counts in distances between configurations, shape (3 + n,) [m/unit].

    It is the lever, but at least ``_LEAST_LEVER``: a joint that moves no solid body still has to be moved.
    """
    return np.maximum([1.0, 1.0, *axis_levers(tree)], _LEAST_LEVER)


def point_levers(tree: ComponentTree, component: int, point: tuple[float, float]) -> FloatArray:
    """Bound how far a point of a component moves per unit of (theta, q...), in all configurations.

    Args:
        tree: The team.
        component: Index of the component.
        point: In the component's frame [m].

    Returns:
        Shape (1 + n,), in m/rad for an angle and without a unit for a prismatic joint; 0 for joints that do
        not move the point.
    """
    levers, reach = np.zeros(1 + len(tree.joints)), hypot(*point)
    for index in tree.ancestors[component]:
        joint = tree.components[index].joint
        if joint is None:
            levers[0] = reach
            continue
        along = hypot(*joint.axis)
        levers[1 + joint.index] = reach if joint.kind == "revolute" else along
        slide = 0.0 if joint.kind == "revolute" else along * max(abs(joint.lower), abs(joint.upper))
        reach += slide + hypot(joint.X_PJ.x, joint.X_PJ.y)
    return levers


def turn_levers(tree: ComponentTree, component: int) -> FloatArray:
    """Return by how much a component turns at most per unit of (theta, q...), shape (1 + n,) [-]."""
    levers = np.zeros(1 + len(tree.joints))
    levers[0] = 1.0
    for index in tree.ancestors[component]:
        joint = tree.components[index].joint
        if joint is not None and joint.kind == "revolute":
            levers[1 + joint.index] = 1.0
    return levers
