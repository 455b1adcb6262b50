"""A component tree as flat arrays, and its forward kinematics, compiled."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.pose import FloatArray, IntArray

if TYPE_CHECKING:
    from coop_drake.tree.component_tree import ComponentTree, ConvexShape, TreeJoint


class TeamArrays(NamedTuple):
    """A component tree as arrays: C components, P convex pieces, V vertices of all pieces, K pairs of pieces.

    Attributes:
        links: Of each component its parent (-1 for the object's), the position of its joint's value in
            z = (x, y, theta, q...), and 1 if the joint is revolute or 0 if it is prismatic, shape (C, 3).
            The object's component counts as turned by theta.
        joints: Of each component X_PJ as (x, y, angle), the joint's sign, and its axis in J, shape (C, 6)
            [m, m, rad, -, -, -]; zeros and sign 1 for the object's.
        pieces: Of each piece its component, its first vertex and the vertex after its last, shape (P, 3).
        vertices: Vertices of the pieces in their component's frame, counter-clockwise, shape (V, 2) [m].
        radii: Growth of each piece, shape (P,) [m].
        discs: A disc (x, y, radius) in the component's frame that holds each grown piece, shape (P, 3) [m].
        pairs: Pairs of pieces that must not touch, shape (K, 2).
    """

    links: IntArray
    joints: FloatArray
    pieces: IntArray
    vertices: FloatArray
    radii: FloatArray
    discs: FloatArray
    pairs: IntArray

    def room(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return room for the poses of all components, and for vertices and discs of all pieces in W."""
        return np.empty((len(self.links), 5)), np.empty(self.vertices.shape), np.empty(self.discs.shape)


@compiled
def moved(x: float, y: float, c: float, s: float, u: float, v: float) -> tuple[float, float]:
    """Return the point (u, v) of a frame at (x, y), turned by the angle with cosine c and sine s [m]."""
    return x + c * u - s * v, y + s * u + c * v


def place(team: TeamArrays, z: FloatArray) -> FloatArray:
    """Compute the pose ``X_WC`` of every component, eq. (3).

    A revolute joint gives ``X_PC = X_PJ @ Rot(sign * q)``, a prismatic one ``X_PC = X_PJ @ Trans(axis * q)``.

    Args:
        team: The team.
        z: Configuration (x, y, theta, q...), shape (3 + n,) [m, rad].

    Returns:
        Rows (x, y, cos(angle), sin(angle), angle), the angle not wrapped, shape (C, 5) [m, rad].
    """
    poses = np.empty((len(team.links), 5))
    place_into(team, z, poses)
    return poses


@compiled(borrows=True)
def place_into(team: TeamArrays, z: FloatArray, poses: FloatArray) -> None:
    """Write what ``place`` returns into ``poses``."""
    for c in range(len(team.links)):
        place_component(team, z, c, poses)


@compiled(inlined=True, borrows=True)
def place_component(team: TeamArrays, z: FloatArray, c: int, poses: FloatArray) -> None:
    """Write the pose of one component, whose parent's pose is there, as ``place`` does.

    Args:
        team: The team.
        z: Configuration, shape (3 + n,) [m, rad].
        c: The component.
        poses: Poses as ``place`` returns them, shape (C, 5); row ``c`` is written [m, rad].
    """
    p = team.links[c, 0]
    if p < 0:
        x, y, angle = z[0], z[1], z[2]
    else:
        jx, jy = team.joints[c, 0], team.joints[c, 1]
        x, y = moved(poses[p, 0], poses[p, 1], poses[p, 2], poses[p, 3], jx, jy)
        angle = poses[p, 4] + team.joints[c, 2]
        q = z[team.links[c, 1]]
        if team.links[c, 2] == 1:
            angle += team.joints[c, 3] * q
        else:
            ax, ay = team.joints[c, 4], team.joints[c, 5]
            x += (cos(angle) * ax - sin(angle) * ay) * q
            y += (sin(angle) * ax + cos(angle) * ay) * q
    poses[c, 0], poses[c, 1], poses[c, 2], poses[c, 3], poses[c, 4] = x, y, cos(angle), sin(angle), angle


def team_arrays(tree: ComponentTree) -> TeamArrays:
    """Write a component tree as flat arrays; pieces in the order of components, bodies and shapes."""
    entries = [
        (c, b, shape)
        for c, component in enumerate(tree.components)
        for b, body in enumerate(component.bodies)
        for shape in body.shapes
    ]
    members: dict[tuple[int, int], list[int]] = {}
    for number, (c, b, _) in enumerate(entries):
        members.setdefault((c, b), []).append(number)
    pairs = [(i, j) for a, b in tree.collision_pairs for i in members.get(a, ()) for j in members.get(b, ())]
    parents = [-1 if component.parent is None else component.parent for component in tree.components]
    joints = [component.joint for component in tree.components]
    last = np.cumsum([len(shape.vertices) for _, _, shape in entries], dtype=np.int64)
    first = np.concatenate(([0], last))[: len(entries)]
    return TeamArrays(
        links=np.array([_link(p, joint) for p, joint in zip(parents, joints, strict=True)], dtype=np.int64),
        joints=np.array([_joint(joint) for joint in joints], dtype=float),
        pieces=np.stack((np.array([c for c, _, _ in entries], dtype=np.int64), first, last), axis=1),
        vertices=np.concatenate([np.empty((0, 2)), *(shape.vertices for _, _, shape in entries)]),
        radii=np.array([shape.radius for _, _, shape in entries], dtype=float),
        discs=np.array([_disc(shape) for _, _, shape in entries], dtype=float).reshape(-1, 3),
        pairs=np.array(pairs, dtype=np.int64).reshape(-1, 2),
    )


def _link(parent: int, joint: TreeJoint | None) -> tuple[int, int, int]:
    if joint is None:
        return parent, 2, 1
    return parent, 3 + joint.index, int(joint.kind == "revolute")


def _joint(joint: TreeJoint | None) -> tuple[float, ...]:
    if joint is None:
        return 0.0, 0.0, 0.0, 1.0, 0.0, 0.0
    return joint.X_PJ.x, joint.X_PJ.y, joint.X_PJ.angle, joint.sign, *joint.axis


def _disc(shape: ConvexShape) -> tuple[float, float, float]:
    middle = 0.5 * (shape.vertices.min(axis=0) + shape.vertices.max(axis=0))
    reach = float(np.hypot(*(shape.vertices - middle).T).max()) + shape.radius
    return float(middle[0]), float(middle[1]), reach
