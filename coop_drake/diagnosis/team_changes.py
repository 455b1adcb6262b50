"""The same team with smaller bodies or with joints that turn further."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from math import pi

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from coop_drake.geometry.pose import FloatArray
from coop_drake.geometry.tree import Body, ComponentTree, ConvexShape, TreeJoint

__all__ = ["base_bodies", "body_size", "object_bodies", "shrunk_bodies", "widened_joints"]

_SLIDE_PER_RADIAN = 0.25
"""A prismatic joint is widened by so much for every radian of a revolute one [m/rad]."""


def base_bodies(tree: ComponentTree) -> frozenset[str]:
    """Names of the bases: of every robot the largest body at the end of its arm that is not in the hand."""
    parents = {component.parent for component in tree.components}
    names = []
    for robot in sorted({joint.robot for joint in tree.joints}):
        bodies = [
            body
            for index, component in enumerate(tree.components)
            for body in component.bodies
            if body.robot == robot and index > 0 and index not in parents
        ]
        if bodies:
            names.append(max(bodies, key=lambda body: float(_outline(body).area)).name)
    return frozenset(names)


def object_bodies(tree: ComponentTree) -> frozenset[str]:
    """Names of the object's own bodies."""
    return frozenset(body.name for body in tree.components[0].bodies if body.robot is None)


def body_size(body: Body) -> tuple[float, float]:
    """Longer and shorter side of the least rectangle about a body, equal for a disc [m]."""
    if len(body.shapes) == 1 and len(body.shapes[0].vertices) == 1:
        return 2.0 * body.shapes[0].radius, 2.0 * body.shapes[0].radius
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(_outline(body)))
    sides = sorted(float(np.hypot(*side)) for side in np.diff(corners[:3], axis=0))
    return sides[-1], sides[0]


def shrunk_bodies(tree: ComponentTree, names: Collection[str], factor: float) -> ComponentTree:
    """Scale some bodies about the middle of their footprint; joints and grasps stay where they are.

    Args:
        tree: The team.
        names: Bodies to scale.
        factor: New over old size, at most 1 [-].
    """
    components = tuple(
        replace(
            component,
            bodies=tuple(_scaled(body, factor) if body.name in names else body for body in component.bodies),
        )
        for component in tree.components
    )
    return ComponentTree(components, tree.sharing_joint)


def widened_joints(tree: ComponentTree, amount: float) -> ComponentTree:
    """Move both limits of every joint outwards; a revolute joint never gets more than a whole turn.

    Args:
        tree: The team.
        amount: How far at either end [rad]; prismatic joints get 0.25 m for every radian.
    """
    components = tuple(
        component if component.joint is None else replace(component, joint=_widened(component.joint, amount))
        for component in tree.components
    )
    return ComponentTree(components, tree.sharing_joint)


def _widened(joint: TreeJoint, amount: float) -> TreeJoint:
    if joint.kind == "prismatic":
        slide = _SLIDE_PER_RADIAN * amount
        return replace(joint, lower=joint.lower - slide, upper=joint.upper + slide)
    turn = min(amount, max(0.0, pi - 0.5 * (joint.upper - joint.lower)))
    return replace(joint, lower=joint.lower - turn, upper=joint.upper + turn)


def _outline(body: Body) -> BaseGeometry:
    return shapely.union_all(
        [shapely.MultiPoint(s.vertices).convex_hull.buffer(s.radius) for s in body.shapes]
    )


def _scaled(body: Body, factor: float) -> Body:
    middle: FloatArray = shapely.get_coordinates(_outline(body).convex_hull.centroid)[0]
    shapes = tuple(
        ConvexShape(middle + factor * (shape.vertices - middle), factor * shape.radius)
        for shape in body.shapes
    )
    return replace(body, shapes=shapes)
