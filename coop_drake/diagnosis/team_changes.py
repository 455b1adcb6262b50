"""The same team with smaller bodies or with joints that turn further."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from itertools import pairwise
from math import pi

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.tree.component_tree import Body, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import FloatArray

__all__ = [
    "base_bodies",
    "body_size",
    "object_bodies",
    "shrink_into_themselves",
    "shrunk_bodies",
    "widened_joints",
]

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
    """Scale some bodies about a point of their footprint; joints and grasps stay where they are.

    It is the middle, or where all of the footprint is not seen from there, a point from which it is.

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


def shrink_into_themselves(tree: ComponentTree, names: Collection[str]) -> bool:
    """Whether some bodies, the smaller they are, need less of the same room: those like a U do not."""
    bodies = [body for component in tree.components for body in component.bodies if body.name in names]
    return not any(_kernel(_outline(body)).is_empty for body in bodies)


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


def _kernel(outline: BaseGeometry) -> BaseGeometry:
    """Points from which all of an outline is seen: those to the left of all its edges."""
    if not isinstance(outline, Polygon) or outline.interiors:
        return Polygon()
    kernel: BaseGeometry = outline.convex_hull
    corners = shapely.get_coordinates(shapely.orient_polygons(outline))
    reach = 4.0 * float(np.hypot(*np.ptp(corners, axis=0)))
    for first, last in pairwise(corners):
        x, y = reach * (last - first) / np.hypot(*(last - first))
        left = np.array([[-x, -y], [x, y], [x - y, y + x], [-x - y, -y + x]])
        kernel = kernel.intersection(Polygon(first + left))
    return kernel


def _middle(outline: BaseGeometry) -> FloatArray:
    """The point towards which an outline is shrunk, shape (2,) [m]."""
    centre, kernel = outline.convex_hull.centroid, _kernel(outline)
    place = centre if kernel.is_empty or kernel.covers(centre) else kernel.centroid
    middle: FloatArray = shapely.get_coordinates(place)[0]
    return middle


def _scaled(body: Body, factor: float) -> Body:
    middle = _middle(_outline(body))
    shapes = tuple(
        ConvexShape(middle + factor * (shape.vertices - middle), factor * shape.radius)
        for shape in body.shapes
    )
    return replace(body, shapes=shapes)
