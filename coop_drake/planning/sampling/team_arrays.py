"""A component tree and the walls as flat arrays, for the compiled checks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coop_drake.geometry.convex import edge_angles, normals
from coop_drake.geometry.sweep_kernels import IntArray
from coop_drake.tree.component_tree import ComponentTree, ConvexShape
from coop_drake.tree.pose import FloatArray


class TeamArrays(NamedTuple):
    """A component tree as arrays, C components, P convex pieces, V vertices in all.

    Attributes:
        parent: Parent component, -1 for the object's, shape (C,).
        axis: Place of the joint's value in z, shape (C,).
        turning: 1 for revolute joints, 0 for prismatic ones, shape (C,).
        joint: X_PJ as (x, y, angle), sign, and axis in J, shape (C, 6).
        reach: Radius of a disc about the component's origin that holds it, shape (C,).
        owner: Component of each piece, shape (P,).
        first: Where each piece's vertices begin, shape (P + 1,).
        vertices: Vertices in the component's frame, shape (V, 2).
        normals: Outward normals of the edges that start at them, shape (V, 2).
        offsets: Their distances from the component's origin, shape (V,).
        radius: Growth of each piece, shape (P,).
        disc: A disc (x, y, radius) that holds each piece, in the component's frame, shape (P, 3).
        pairs: Pairs of pieces that must not touch, shape (K, 2).
    """

    parent: IntArray
    axis: IntArray
    turning: IntArray
    joint: FloatArray
    reach: FloatArray
    owner: IntArray
    first: IntArray
    vertices: FloatArray
    normals: FloatArray
    offsets: FloatArray
    radius: FloatArray
    disc: FloatArray
    pairs: IntArray


def team_arrays(tree: ComponentTree) -> TeamArrays:
    """Lay a tree out for the compiled checks."""
    joints = [component.joint for component in tree.components]
    entries = [
        (c, b, shape)
        for c, component in enumerate(tree.components)
        for b, body in enumerate(component.bodies)
        for shape in body.shapes
    ]
    rings = [shape.vertices for _, _, shape in entries]
    edges = [normals(edge_angles(ring)) if len(ring) > 1 else np.zeros((1, 2)) for ring in rings]
    members: dict[tuple[int, int], list[int]] = {}
    for number, (c, b, _) in enumerate(entries):
        members.setdefault((c, b), []).append(number)
    pairs = [(i, j) for a, b in tree.collision_pairs for i in members[a] for j in members[b]]
    reach = [
        max((float(np.hypot(*s.vertices.T).max()) + s.radius for i, _, s in entries if i == c), default=0.0)
        for c in range(len(tree.components))
    ]
    return TeamArrays(
        parent=np.array([-1 if c.parent is None else c.parent for c in tree.components]),
        axis=np.array([2 if joint is None else 3 + joint.index for joint in joints]),
        turning=np.array([0 if joint is not None and joint.kind == "prismatic" else 1 for joint in joints]),
        joint=np.array(
            [
                (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
                if joint is None
                else (joint.X_PJ.x, joint.X_PJ.y, joint.X_PJ.angle, joint.sign, *joint.axis)
                for joint in joints
            ]
        ),
        reach=np.array(reach),
        owner=np.array([c for c, _, _ in entries]),
        first=np.concatenate(([0], np.cumsum([len(ring) for ring in rings]))),
        vertices=np.concatenate(rings),
        normals=np.concatenate(edges),
        offsets=np.concatenate([(n * ring).sum(axis=1) for n, ring in zip(edges, rings, strict=True)]),
        radius=np.array([shape.radius for _, _, shape in entries]),
        disc=np.array([_disc(shape) for _, _, shape in entries]),
        pairs=np.array(pairs, dtype=np.int64).reshape(-1, 2),
    )


def _disc(shape: ConvexShape) -> tuple[float, float, float]:
    middle = 0.5 * (shape.vertices.min(axis=0) + shape.vertices.max(axis=0))
    reach = float(np.hypot(*(shape.vertices - middle).T).max()) + shape.radius
    return float(middle[0]), float(middle[1]), reach
