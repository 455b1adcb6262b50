"""The object, the arms' links and the bases as one kinematic tree rooted at the object, eq. (3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, hypot, inf, pi, sin
from typing import TYPE_CHECKING, Literal

import numpy as np

from coop_drake.tree.pose import FloatArray, PlanarPose

if TYPE_CHECKING:
    from coop_drake.tree.team_arrays import TeamArrays


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

    - to its plant: ``plant/chain.py`` (``MOVABLE``, which refuses all other kinds), ``component_tree.py``,
      ``planarity.py``, ``joint_survey.py``, ``fixing.py`` and ``planar_chain.py``, all in ``plant/``;
    - to its geometry: ``unit`` below, ``ComponentTree.reach``, ``tree/team_arrays.py`` (its pose) and
      ``tree/levers.py``; ``geometry/sweep_kernels.py`` and ``swept_tree.py`` (over-sweeps),
      ``geometry/under_kernels.py`` (under-sweeps);
    - to the control laws: ``laws/robot_dynamics.py`` (velocities and forces);
    - to the planner: ``answers/problem.py`` (room beyond limits), ``planning/cells/splitting.py``
      (``finest_widths``), ``planning/rescaling.py`` and ``diagnosis/changes.py``;
    - to the budget of a deployment: ``scenario/budget_file.py`` (errors of velocities);
    - independently of all these to ``checking/team.py``, and in ``verification/`` to ``question.py``,
      ``solids.py``, ``speeds.py`` and ``runs/placement.py``, ``mechanics.py`` and ``speeds.py``.

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

    @cached_property
    def arrays(self) -> TeamArrays:
        """The tree as flat arrays, for compiled functions."""
        # Importing numba takes half a second: only where something is computed.
        from coop_drake.tree.team_arrays import team_arrays

        return team_arrays(self)

    def poses(self, configuration: Sequence[float] | FloatArray) -> tuple[PlanarPose, ...]:
        """Pose ``X_WC`` of every component, the numbers of the compiled ``place``.

        Args:
            configuration: z = (x, y, theta, q...), shape (3 + n,) [m, rad].
        """
        x, y, theta, *q = (float(value) for value in configuration)
        poses: list[PlanarPose] = []
        for component in self.components:
            joint, parent = component.joint, component.parent
            if joint is None or parent is None:
                poses.append(PlanarPose(x, y, theta))
                continue
            X_PJ, value = poses[parent] @ joint.X_PJ, q[joint.index]
            if joint.kind == "revolute":
                poses.append(PlanarPose(X_PJ.x, X_PJ.y, X_PJ.angle + joint.sign * value))
            else:
                c, s, (ax, ay) = cos(X_PJ.angle), sin(X_PJ.angle), joint.axis
                moved = X_PJ.x + (c * ax - s * ay) * value, X_PJ.y + (s * ax + c * ay) * value
                poses.append(PlanarPose(*moved, X_PJ.angle))
        return tuple(poses)

    @cached_property
    def reach(self) -> float:
        """Upper bound on the distance of any footprint point from the object's origin [m]."""
        return max(self._component_reach(index) for index in range(len(self.components)))

    def _component_reach(self, index: int) -> float:
        component = self.components[index]
        own = max(
            (
                hypot(*vertex) + shape.radius
                for body in component.bodies
                for shape in body.shapes
                for vertex in shape.vertices
            ),
            default=0.0,
        )
        for ancestor in self.ancestors[index]:
            joint = self.components[ancestor].joint
            if joint is not None:
                slide = hypot(*joint.axis) * max(abs(joint.lower), abs(joint.upper))
                slide = slide if joint.kind == "prismatic" else 0.0
                own += hypot(joint.X_PJ.x, joint.X_PJ.y) + slide
        return own
