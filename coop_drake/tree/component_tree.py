"""The object, the arms' links and the bases as one kinematic tree rooted at the object, eq. (3).

Its forward kinematics are compiled; what they take of the tree stands in flat arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, inf, log2, pi, sin
from typing import Literal, NamedTuple

import numpy as np

from coop_drake.jit import compiled
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.typed_data import Number


@dataclass(frozen=True)
class PlanarPose:
    """The pose ``X_AB`` of frame B measured in frame A, in Drake's notation: a rigid motion of the plane.

    Attributes:
        x: First coordinate of B's origin in A [m].
        y: Second coordinate of B's origin in A [m].
        angle: Rotation from A to B, counter-clockwise [rad], not wrapped.
    """

    x: float = 0.0
    y: float = 0.0
    angle: float = 0.0

    def __matmul__(self, other: PlanarPose) -> PlanarPose:
        """Compose: ``X_AC = X_AB @ X_BC``."""
        c, s = cos(self.angle), sin(self.angle)
        return PlanarPose(
            self.x + c * other.x - s * other.y, self.y + s * other.x + c * other.y, self.angle + other.angle
        )

    def inverse(self) -> PlanarPose:
        """Return ``X_BA``."""
        c, s = cos(self.angle), sin(self.angle)
        return PlanarPose(-c * self.x - s * self.y, s * self.x - c * self.y, -self.angle)

    def apply(self, points: FloatArray) -> FloatArray:
        """Map points given in B to A; shape (..., 2) [m] to the same shape."""
        c, s = cos(self.angle), sin(self.angle)
        moved: FloatArray = points @ np.array([[c, s], [-s, c]]) + np.array([self.x, self.y])
        return moved


@dataclass(frozen=True)
class ConvexShape:
    """The convex hull of some vertices, grown by a radius: polygon, disc, capsule or rounded polygon.

    Attributes:
        vertices: Hull vertices, counter-clockwise, in the component's frame C, shape (n, 2) [m];
            one vertex makes a disc, two make a capsule.
        radius: Growth [m], zero for a plain polygon.
    """

    vertices: FloatArray
    radius: float = 0.0


@dataclass(frozen=True)
class Body:
    """One rigid body as the plant knows it.

    Attributes:
        name: Scoped name, for example ``robot_0::link_1``.
        robot: Index of the robot that owns it, or None for the object.
        shapes: Convex pieces whose union is the footprint; the pieces may overlap.
    """

    name: str
    robot: int | None
    shapes: tuple[ConvexShape, ...]


@dataclass(frozen=True)
class TreeJoint:
    """A joint seen from the object outwards: frame J is fixed on the parent, the child C moves against J.

    A revolute joint gives ``X_PC = X_PJ @ Rot(sign * q)``, a prismatic one ``X_PC = X_PJ @ Trans(axis * q)``.
    A new kind of joint has to be added

    - to its plant: ``chain.py`` (``MOVABLE``, which refuses all other kinds), ``component_tree.py`` and
      ``facts.py``, all in ``plant/``;
    - to its geometry: ``unit``, poses and levers in this file; ``geometry/sweeps.py`` and ``swept_tree.py``;
    - to the control laws: ``laws/robot_dynamics.py`` (velocities and forces);
    - to the planner: ``answers/problem.py`` (room beyond limits), ``planning/cells/exploration.py``
      (``finest_widths``), ``planning/rescaling.py`` and ``diagnosis/diagnosing.py``;
    - to the budget of a deployment: ``scenario/budget_file.py`` (errors of velocities);
    - independently of all these to ``checking/team.py``, and in ``verification/`` to ``question.py``,
      ``gains.py`` and ``runs/bodies.py``.

    Attributes:
        name: Scoped name, for example ``robot_0::elbow``.
        kind: ``revolute`` or ``prismatic``.
        robot: Index of the robot that owns it.
        index: Position of its value in q, the vector of all joints of the team.
        X_PJ: Pose of the joint's frame in the parent component's frame.
        sign: +1 or -1: how the plant's joint value turns the child (revolute).
        axis: Direction in J that the child moves along per unit of q, shape (2,) (prismatic).
        lower: Lower limit [rad or m]; minus infinity for a revolute joint without limits, which is a circle.
        upper: Upper limit [rad or m]; infinity for a circle.
    """

    name: str
    kind: Literal["revolute", "prismatic"]
    robot: int
    index: int
    X_PJ: PlanarPose
    sign: float
    axis: tuple[float, float]
    lower: float
    upper: float

    @property
    def circular(self) -> bool:
        """Whether its values are those of a circle: any, and those that differ by whole turns are one."""
        return (self.lower, self.upper) == (-inf, inf)

    @property
    def range(self) -> tuple[float, float]:
        """Ends of an interval that holds each of its configurations: its limits, or one turn of a circle."""
        return (-pi, pi) if self.circular else (self.lower, self.upper)

    @property
    def unit(self) -> str:
        """Unit of its value: rad, or m if it slides."""
        return "rad" if self.kind == "revolute" else "m"


@dataclass(frozen=True)
class Component:
    """Bodies that move as one: welded bodies share a component.

    Attributes:
        name: Name of its first body.
        parent: Index of the parent component, None for the object's.
        joint: The joint that moves it against its parent, None for the object's.
        bodies: The rigid bodies in it.
    """

    name: str
    parent: int | None
    joint: TreeJoint | None
    bodies: tuple[Body, ...]


@dataclass(frozen=True)
class ComponentTree:
    """The whole team as a tree of components, parents first, the object's component at index 0.

    A configuration is ``z = (x, y, theta, q...)``: the object's pose in W and every joint, robots in the
    scenario's order, each robot's joints in its model's order (from its base outwards).

    Attributes:
        components: Parents before children.
        unchecked_pairs: Pairs of body names that are not checked for collision with each other: a movable
            joint connects them, or their models exclude the pair, as models of imported robots do for all
            pairs of their own links.
    """

    components: tuple[Component, ...]
    unchecked_pairs: frozenset[tuple[str, str]]

    @cached_property
    def joints(self) -> tuple[TreeJoint, ...]:
        """All joints, ordered as their values stand in q."""
        return tuple(sorted((c.joint for c in self.components if c.joint), key=lambda joint: joint.index))

    @cached_property
    def joint_lower(self) -> FloatArray:
        """Lower joint limits, shape (n,)."""
        return np.array([joint.lower for joint in self.joints])

    @cached_property
    def joint_upper(self) -> FloatArray:
        """Upper joint limits, shape (n,)."""
        return np.array([joint.upper for joint in self.joints])

    @cached_property
    def circular(self) -> tuple[bool, ...]:
        """Which axes of (theta, q...) are circles, length 1 + n: theta, and all joints without limits."""
        return (True, *(joint.circular for joint in self.joints))

    @cached_property
    def range_lower(self) -> FloatArray:
        """Lower ends of the joints' ranges, shape (n,): limits, or half a turn on either side of zero."""
        return np.array([joint.range[0] for joint in self.joints])

    @cached_property
    def range_upper(self) -> FloatArray:
        """Upper ends of the joints' ranges, shape (n,)."""
        return np.array([joint.range[1] for joint in self.joints])

    @cached_property
    def ancestors(self) -> tuple[tuple[int, ...], ...]:
        """For each component the components from itself to the object's, both included."""
        chains: list[tuple[int, ...]] = []
        for index, component in enumerate(self.components):
            chains.append((index,) if component.parent is None else (index, *chains[component.parent]))
        return tuple(chains)

    @cached_property
    def collision_pairs(self) -> tuple[tuple[tuple[int, int], tuple[int, int]], ...]:
        """Pairs ``((component, body), (component, body))`` that must never overlap.

        Bodies of one component never move against each other; those of ``unchecked_pairs`` may overlap.
        """
        entries = [
            (i, j, body.name) for i, c in enumerate(self.components) for j, body in enumerate(c.bodies)
        ]
        return tuple(
            ((i, j), (k, m))
            for n, (i, j, first) in enumerate(entries)
            for k, m, second in entries[n + 1 :]
            if i != k
            and (first, second) not in self.unchecked_pairs
            and (second, first) not in self.unchecked_pairs
        )

    def stages_between(self, first: int, second: int) -> tuple[int, int]:
        """Numbers of joints from two components to the nearest component that carries both."""
        chains = self.ancestors[first], self.ancestors[second]
        common = next(index for index in chains[0] if index in chains[1])
        return chains[0].index(common), chains[1].index(common)

    @cached_property
    def arrays(self) -> TeamArrays:
        """The tree as flat arrays, for compiled functions."""
        return team_arrays(self)

    def poses(self, configuration: Sequence[float] | FloatArray) -> tuple[PlanarPose, ...]:
        """Pose ``X_WC`` of every component, see ``place``.

        Args:
            configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        """
        rows = place(self.arrays, np.asarray(configuration, dtype=float))
        return tuple(PlanarPose(x, y, angle) for x, y, _, _, angle in rows.tolist())

    @cached_property
    def reach(self) -> float:
        """Upper bound on the distance of any footprint point from the object's origin [m]."""
        return axis_levers(self)[0]


# Circular axes: theta and every joint without limits, on which values that differ by whole turns are one.


def nearest_turn(angle: float) -> float:
    """The same angle modulo 2 pi in [-pi, pi)."""
    return (angle + pi) % (2.0 * pi) - pi


def whole_turns(values: FloatArray, near: FloatArray) -> FloatArray:
    """Whole turns that bring angles nearest to others, exactly zero where they are; any shape [rad]."""
    return 2.0 * pi * np.rint((near - values) / (2.0 * pi))


def turns_to(values: Sequence[float], near: Sequence[float], circular: Sequence[bool]) -> FloatArray:
    """Whole turns that bring values of axes nearest to others; zero on axes that are no circles.

    Args:
        values: Values of (theta, q...), length 1 + n [rad, m].
        near: Others.
        circular: Which axes are circles.

    Returns:
        What to add to the values, shape (1 + n,) [rad, m].
    """
    both = zip(values, near, circular, strict=True)
    return np.array([there + nearest_turn(here - there) - here if on else 0.0 for here, there, on in both])


# The metric between configurations, and the unit of length in which a team has the usual size.

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
    pieces = [[shape for body in component.bodies for shape in body.shapes] for component in tree.components]
    reaches = [
        max((float((s.vertices**2).sum(axis=1).max() ** 0.5) + s.radius for s in shapes), default=0.0)
        for shapes in pieces
    ]
    levers = [_levers(tree, component, reach) for component, reach in enumerate(reaches)]
    return tuple(np.max(levers, axis=0).tolist())


def _levers(tree: ComponentTree, component: int, reach: float) -> FloatArray:
    """As ``point_levers``, for all points of a component within a reach of its origin [m]."""
    levers = np.zeros(1 + len(tree.joints))
    for index in tree.ancestors[component]:
        joint = tree.components[index].joint
        if joint is None:
            levers[0] = reach
            continue
        along, revolute = (joint.axis[0] ** 2 + joint.axis[1] ** 2) ** 0.5, joint.kind == "revolute"
        levers[1 + joint.index] = reach if revolute else along
        slide = 0.0 if revolute else along * max(abs(joint.lower), abs(joint.upper))
        reach += slide + (joint.X_PJ.x**2 + joint.X_PJ.y**2) ** 0.5
    return levers


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
    return _levers(tree, component, hypot(*point))


def turn_levers(tree: ComponentTree, component: int) -> FloatArray:
    """Return by how much a component turns at most per unit of (theta, q...), shape (1 + n,) [-]."""
    levers = np.zeros(1 + len(tree.joints))
    levers[0] = 1.0
    for index in tree.ancestors[component]:
        joint = tree.components[index].joint
        if joint is not None and joint.kind == "revolute":
            levers[1 + joint.index] = 1.0
    return levers


# Mass properties of the bodies of a team, as budgets state them.

BODY = "component", "mass", "x", "y", "inertia", "robot"
"""What is stated of a body: index of its component in the team's tree, mass [kg], centre of mass in the
component's frame [m], inertia about the vertical axis through it [kg m^2], and the index of the robot that
moves it. The object stands there once for each robot, with the robot's share of its mass and inertia."""

Bodies = tuple[tuple[Number, ...], ...]
"""The bodies of a team, each with the numbers of ``BODY``; laws of the whole team need no robots."""


# The tree as flat arrays, and its forward kinematics, compiled.


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
        pairs: Pairs of pieces that must not touch, and for both the number of joints between them and the
            nearest component that carries both, shape (K, 4).
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
    pairs = [
        (i, j, *tree.stages_between(a[0], b[0]))
        for a, b in tree.collision_pairs
        for i in members.get(a, ())
        for j in members.get(b, ())
    ]
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
        pairs=np.array(pairs, dtype=np.int64).reshape(-1, 4),
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
