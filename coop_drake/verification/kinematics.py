"""The team's convex solids and the joints that move them, and kinematics of the verifier's own.

A stage is one joint that moves a solid; the stages of a component begin with its own joint and end with theta
of the object. Configurations z = (x, y, theta, q...) of a log have shape (T, 3 + n) [m, rad]: the value of a
joint stands at 3 + its index.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from coop_drake.tree.component_tree import ComponentTree, TreeJoint
from coop_drake.tree.pose import FloatArray, PlanarPose

THETA = TreeJoint("theta", "revolute", -1, -1, PlanarPose(), 1.0, (0.0, 0.0), -inf, inf)
"""The object's angle as the joint by which the floor carries the object: it stands before q in z."""

Stages = tuple[TreeJoint, ...]
"""What moves a component: its own joint first, theta last."""


@dataclass(frozen=True)
class Solid:
    """One convex piece of one body.

    Attributes:
        name: Name of its body.
        component: Index of its component.
        body: Index of its body in the component.
        vertices: Vertices in the component's frame, counter-clockwise, shape (n, 2) [m].
        radius: The solid is the hull of its vertices, grown by this [m].
        stages: What moves it: its own joint first, theta last.
    """

    name: str
    component: int
    body: int
    vertices: FloatArray
    radius: float
    stages: Stages


def team_solids(tree: ComponentTree) -> tuple[Solid, ...]:
    """List every convex piece of a team."""
    return tuple(
        Solid(body.name, index, number, np.asarray(shape.vertices, dtype=float), shape.radius, stages)
        for index, component in enumerate(tree.components)
        for stages in [component_stages(tree, index)]
        for number, body in enumerate(component.bodies)
        for shape in body.shapes
    )


def component_stages(tree: ComponentTree, index: int) -> Stages:
    """The stages that move a component: its own joint first, theta last."""
    joints = (tree.components[i].joint for i in tree.ancestors[index])
    return (*[joint for joint in joints if joint is not None], THETA)


def checked_pairs(
    tree: ComponentTree, solids: Collection[Solid]
) -> tuple[tuple[Solid, Solid, int, int], ...]:
    """Pairs of solids that must never overlap.

    With each pair stand, for both solids, the number of joints up to the component that carries the two.
    """
    members: dict[tuple[int, int], list[Solid]] = {}
    for solid in solids:
        members.setdefault((solid.component, solid.body), []).append(solid)
    pairs = []
    for first, second in tree.collision_pairs:
        one, other = (tree.ancestors[component] for component, _ in (first, second))
        common = max(set(one) & set(other))
        pairs += [
            (a, b, one.index(common), other.index(common))
            for a in members.get(first, [])
            for b in members.get(second, [])
        ]
    return tuple(pairs)


def cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """The component out of the plane of the product of vectors (T, 2), shape (T,)."""
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def left(vectors: FloatArray) -> FloatArray:
    """Vectors (T, 2) turned by a right angle, counter-clockwise."""
    return np.column_stack((-vectors[:, 1], vectors[:, 0]))


def turned(vectors: FloatArray, angles: FloatArray) -> FloatArray:
    """Vectors (T, 2) turned by angles (T,)."""
    c, s = np.cos(angles), np.sin(angles)
    return np.column_stack((c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]))


def points_in_world(points: FloatArray, stages: Stages, z: FloatArray) -> FloatArray:
    """Carry points of one component to W by its stages.

    Args:
        points: Points in the component's frame, shape (m, 2) [m].
        stages: What moves the component: its own joint first, theta last.
        z: Configurations (x, y, theta, q...), shape (T, 3 + n) [m, rad].

    Returns:
        Shape (T, m, 2) [m].
    """
    carried = np.broadcast_to(points, (len(z), *points.shape))
    for stage in stages:
        values = z[:, 3 + stage.index]
        if stage.kind == "prismatic":
            carried = carried + values[:, None, None] * np.array(stage.axis)
        else:
            c, s = np.cos(stage.sign * values)[:, None], np.sin(stage.sign * values)[:, None]
            x, y = carried[..., 0], carried[..., 1]
            carried = np.stack((c * x - s * y, s * x + c * y), axis=-1)
        carried = stage.X_PJ.apply(carried)
    placed: FloatArray = carried + z[:, None, :2]
    return placed


def turns(stages: Stages, z: FloatArray) -> FloatArray:
    """Angles of one component in W, not wrapped, shape (T,) [rad]; arguments as above."""
    angles = np.zeros(len(z))
    for stage in stages:
        angles += stage.X_PJ.angle
        if stage.kind == "revolute":
            angles += stage.sign * z[:, 3 + stage.index]
    return angles


def levers(reach: float, stages: Stages, most: FloatArray) -> FloatArray:
    """Bound how far a point of a component moves for each unit of every stage, at all configurations.

    Args:
        reach: Largest distance of the component's points from its frame's origin [m].
        stages: The stages that count: its own joint first.
        most: Largest magnitudes of z, which bound how far joints slide, shape (3 + n,) [m, rad].

    Returns:
        One bound for each stage, shape (stages,) [m for each rad, or m for each m].
    """
    bounds = []
    for stage in stages:
        if stage.kind == "prismatic":
            slide = float(np.hypot(*stage.axis))
            bounds.append(slide)
            reach += slide * float(most[3 + stage.index])
        else:
            bounds.append(reach)
        reach += float(np.hypot(stage.X_PJ.x, stage.X_PJ.y))
    return np.array(bounds)


class Motion(NamedTuple):
    """How a point of a component moves in W.

    Attributes:
        place: Its position from the object's origin, shape (T, 2) [m].
        velocity: Shape (T, 2) [m/s].
        acceleration: Shape (T, 2) [m/s^2].
        rate: Rate of the component's angle, shape (T,) [rad/s].
        turning: Its second derivative, shape (T,) [rad/s^2].
    """

    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    rate: FloatArray
    turning: FloatArray


def moved(
    point: FloatArray, stages: Stages, z: FloatArray, rates: FloatArray, accelerations: FloatArray
) -> Motion:
    """Carry a point of a component, shape (2,) [m], with its derivatives through its stages."""
    count = len(z)
    x, v, a = np.tile(point, (count, 1)), np.zeros((count, 2)), np.zeros((count, 2))
    spin, turning = np.zeros(count), np.zeros(count)
    for stage in stages:
        scale = stage.sign if stage.kind == "revolute" else 1.0
        q, rate, second = (scale * values[:, 3 + stage.index] for values in (z, rates, accelerations))
        if stage.kind == "prismatic":
            x, v, a = (old + new[:, None] * stage.axis for old, new in ((x, q), (v, rate), (a, second)))
        else:
            x, v, a = (turned(old, q) for old in (x, v, a))
            w = rate[:, None]
            a = a + 2.0 * w * left(v) + second[:, None] * left(x) - w * w * x
            v, spin, turning = v + w * left(x), spin + rate, turning + second
        angle = np.full(count, stage.X_PJ.angle)
        x, v, a = (turned(old, angle) for old in (x, v, a))
        x = x + np.array([stage.X_PJ.x, stage.X_PJ.y])
    return Motion(x, v + rates[:, :2], a + accelerations[:, :2], spin, turning)
