"""The convex solids of a team, each with the joints that move it, from its own joint to the object."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

import numpy as np

from coop_drake.tree.component_tree import ComponentTree, TreeJoint
from coop_drake.tree.pose import FloatArray, PlanarPose


@dataclass(frozen=True)
class Stage:
    """One joint that moves a solid, or theta of the object.

    Attributes:
        axis: Index into (theta, q...).
        kind: ``revolute`` (also theta) or ``prismatic``.
        scale: Factor from the axis value to the motion: the sign of a revolute joint, 1 for a prismatic one.
        direction: Direction of a prismatic joint in its frame J, shape (2,).
        X_PJ: Pose of J in the parent component; the identity for theta.
    """

    axis: int
    kind: Literal["revolute", "prismatic"]
    scale: float
    direction: FloatArray
    X_PJ: PlanarPose


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
    stages: tuple[Stage, ...]


def team_solids(tree: ComponentTree) -> tuple[Solid, ...]:
    """List every convex piece of a team."""
    return tuple(
        Solid(body.name, index, number, np.asarray(shape.vertices, dtype=float), shape.radius, stages)
        for index, component in enumerate(tree.components)
        for stages in [component_stages(tree, index)]
        for number, body in enumerate(component.bodies)
        for shape in body.shapes
    )


def component_stages(tree: ComponentTree, index: int) -> tuple[Stage, ...]:
    """The stages that move a component: its own joint first, theta last."""
    joints = (tree.components[i].joint for i in tree.ancestors[index])
    return (*[_stage(joint) for joint in joints if joint is not None], _THETA)


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


_THETA = Stage(0, "revolute", 1.0, np.zeros(2), PlanarPose())


def _stage(joint: TreeJoint) -> Stage:
    scale = joint.sign if joint.kind == "revolute" else 1.0
    return Stage(1 + joint.index, joint.kind, scale, np.array(joint.axis), joint.X_PJ)
