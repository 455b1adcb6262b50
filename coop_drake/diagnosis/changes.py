"""Builds changed copies of a team: with smaller bodies, or with wider joint limits."""

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

SLIDE_PER_RADIAN = 0.25
"""Widening of a prismatic joint for every radian of a revolute one: the length of a short link [m/rad]."""


def base_bodies(tree: ComponentTree) -> frozenset[str]:
    """Names of the bases: of every robot the largest body of the components that carry no other one."""
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


def shrunk_bodies(tree: ComponentTree, names: Collection[str], factor: float) -> ComponentTree:
    """Scale some bodies by a factor up to 1 about a point of their footprint; joints and grasps stay.

    The point is the centroid of the convex hull if all of the footprint is visible from there, else the
    centroid of the footprint's kernel, the set of points from which all of it is visible.
    """
    components = tuple(
        replace(
            component,
            bodies=tuple(_scaled(body, factor) if body.name in names else body for body in component.bodies),
        )
        for component in tree.components
    )
    return ComponentTree(components, tree.unchecked_pairs)


def shrink_into_themselves(tree: ComponentTree, names: Collection[str]) -> bool:
    """Whether smaller copies of some bodies lie inside larger ones; a U's, for instance, do not."""
    bodies = [body for component in tree.components for body in component.bodies if body.name in names]
    return not any(_kernel(_outline(body)).is_empty for body in bodies)


def widened_joints(tree: ComponentTree, amount: float) -> ComponentTree:
    """Move both limits of every joint outwards [rad]; a revolute joint never gets more than a whole turn.

    Prismatic joints get 0.25 m for every radian; joints without limits stay as they are.
    """
    components = tuple(
        component if component.joint is None else replace(component, joint=_widened(component.joint, amount))
        for component in tree.components
    )
    return ComponentTree(components, tree.unchecked_pairs)


def _widened(joint: TreeJoint, amount: float) -> TreeJoint:
    if joint.circular:
        return joint
    if joint.kind == "prismatic":
        slide = SLIDE_PER_RADIAN * amount
        return replace(joint, lower=joint.lower - slide, upper=joint.upper + slide)
    turn = min(amount, max(0.0, pi - 0.5 * (joint.upper - joint.lower)))
    return replace(joint, lower=joint.lower - turn, upper=joint.upper + turn)


def _outline(body: Body) -> BaseGeometry:
    return shapely.union_all(
        [shapely.MultiPoint(s.vertices).convex_hull.buffer(s.radius) for s in body.shapes]
    )


def _kernel(outline: BaseGeometry) -> BaseGeometry:
    """Points from which all of an outline is visible: those to the left of all its edges."""
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
    """The point about which an outline is scaled, shape (2,) [m]."""
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
