"""Reads the component tree, eq. (3), from the team's plant: bodies, joints and collision geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.geometry import SceneGraphInspector
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.tree import Joint, RigidBody
from pydrake.systems.framework import Context

from coop_drake.plant.chain import limits_of, scoped
from coop_drake.plant.footprint import DIGITS, project
from coop_drake.plant.parsing import bodies_of, joints_of, refusal
from coop_drake.plant.planarity import axis_in_world
from coop_drake.plant.shadows import without_covered
from coop_drake.plant.team import TeamPlant
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import PlanarPose

_LARGEST = 1e4
"""Largest distance of a footprint from its joint; more is taken for an error in the file [m]."""


def read_component_tree(team: TeamPlant) -> ComponentTree:
    """Read footprints and joints of the team, as the planner needs them.

    Bodies that are welded together make one component; the object's comes first. The frame C of a component
    stands at its joint, parallel to L when every joint is zero. Joints lead from the object outwards: a joint
    that leads from base to end effector in its file has sign = -1. Bodies without visual and collision
    geometry are left out.

    Raises:
        ScenarioError: A body with visual but no collision geometry, or a shape without a bounded footprint.
    """
    return _TreeReader(team).tree()


@dataclass(frozen=True)
class _Link:
    """A movable joint with the component that it leads to."""

    joint: Joint
    bodies: tuple[RigidBody, ...]
    outwards: bool
    X_WC: RigidTransform


class _TreeReader:
    """Reads the plant from the object outwards, with all positions zero."""

    def __init__(self, team: TeamPlant) -> None:
        self.team = team
        self.plant = team.plant
        self.inspector: SceneGraphInspector = team.scene_graph.model_inspector()
        self.context: Context = self.plant.CreateDefaultContext()
        self.plant.SetPositions(self.context, np.zeros(self.plant.num_positions()))
        self.may_overlap = self._may_overlap()
        self.welds = [j for j in joints_of(self.plant) if j.type_name() == "weld"]
        self.robot_of = {
            int(body.index()): robot.index
            for robot, models in zip(team.robots, team.assembly.robots, strict=True)
            for body in bodies_of(self.plant, models.models)
        }

    def tree(self) -> ComponentTree:
        """Components breadth first, robots in order, and the pairs of bodies that may overlap."""
        root = self._welded_to(self.team.object_body)
        queue = [(root, RigidTransform())]
        components = [self._component(root, None, None, RigidTransform())]
        used: set[int] = set()
        for at, (members, X_WP) in enumerate(queue):  # the queue grows in the loop
            for index, joint in enumerate(self.team.joints):
                link = None if index in used else self._link(joint, members)
                if link is not None:
                    used.add(index)
                    queue.append((link.bodies, link.X_WC))
                    tree_joint = self._tree_joint(link, index, X_WP)
                    components.append(self._component(link.bodies, at, tree_joint, link.X_WC))
        self._check_solid(components)
        return ComponentTree(tuple(components), self.may_overlap)

    def _check_solid(self, components: list[Component]) -> None:
        """Refuse a robot or an object without any collision geometry."""
        solid = {body.robot for component in components for body in component.bodies}
        for robot, models in enumerate(self.team.assembly.robots):
            if robot not in solid:
                raise refusal(self.team.scenario, models, models.name, "a robot with collision geometry")
        if None not in solid:
            name = self.team.assembly.object_model
            raise refusal(self.team.scenario, None, name, "an object with collision geometry")

    def _welded_to(self, body: RigidBody) -> tuple[RigidBody, ...]:
        """All bodies welded to one, itself included: the object's bodies first, then in the plant's order."""
        found = {int(body.index()): body}
        grew = True
        while grew:
            grew = False
            for weld in self.welds:
                ends = (weld.parent_body(), weld.child_body())
                inside = [int(end.index()) in found for end in ends]
                if any(inside) and not all(inside):
                    found.update({int(end.index()): end for end in ends})
                    grew = True
        return tuple(
            sorted(found.values(), key=lambda b: (self.robot_of.get(int(b.index()), -1), int(b.index())))
        )

    def _link(self, joint: Joint, members: tuple[RigidBody, ...]) -> _Link | None:
        inside = {int(body.index()) for body in members}
        parent, child = joint.parent_body(), joint.child_body()
        if int(parent.index()) in inside:
            outer, outwards = child, True
        elif int(child.index()) in inside:
            outer, outwards = parent, False
        else:
            return None
        origin = joint.frame_on_parent().CalcPoseInWorld(self.context).translation()
        return _Link(joint, self._welded_to(outer), outwards, RigidTransform(RotationMatrix(), origin))

    def _tree_joint(self, link: _Link, index: int, X_WP: RigidTransform) -> TreeJoint:
        axis = axis_in_world(link.joint, self.context) * (1.0 if link.outwards else -1.0)
        lower, upper = limits_of(link.joint)
        offset = link.X_WC.translation() - X_WP.translation()
        revolute = link.joint.type_name() == "revolute"
        return TreeJoint(
            name=scoped(self.plant, link.joint),
            kind="revolute" if revolute else "prismatic",
            robot=self.robot_of[int(link.joint.child_body().index())],
            index=index,
            X_PJ=PlanarPose(round(float(offset[0]), DIGITS), round(float(offset[1]), DIGITS), 0.0),
            sign=float(np.sign(axis[2])) if revolute else 1.0,
            axis=(0.0, 0.0) if revolute else (round(float(axis[0]), DIGITS), round(float(axis[1]), DIGITS)),
            lower=lower,
            upper=upper,
        )

    def _component(
        self, bodies: tuple[RigidBody, ...], parent: int | None, joint: TreeJoint | None, X_WC: RigidTransform
    ) -> Component:
        X_CW = X_WC.inverse()
        footprints = tuple(
            Body(scoped(self.plant, body), self.robot_of.get(int(body.index())), self._shapes(body, X_CW))
            for body in bodies
        )
        solid = tuple(body for body in without_covered(footprints, self.may_overlap) if body.shapes)
        return Component(footprints[0].name, parent, joint, solid)

    def _shapes(self, body: RigidBody, X_CW: RigidTransform) -> tuple[ConvexShape, ...]:
        X_CB = X_CW @ body.EvalPoseInWorld(self.context)
        geometries = self.plant.GetCollisionGeometriesForBody(body)
        if not geometries and self.plant.GetVisualGeometriesForBody(body):
            raise self._refusal(body, "bodies with collision geometry (this one has visual geometry only)")
        shapes = []
        for geometry in geometries:
            try:
                X_BG = self.inspector.GetPoseInFrame(geometry)
                shapes.append(_checked(project(self.inspector.GetShape(geometry), X_CB @ X_BG)))
            except (TypeError, RuntimeError) as error:
                raise self._refusal(body, f"collision shapes with a bounded footprint ({error})") from error
        return tuple(shapes)

    def _refusal(self, body: RigidBody, allowed: str) -> Exception:
        robot = self.robot_of.get(int(body.index()))
        assembly = None if robot is None else self.team.assembly.robots[robot]
        return refusal(self.team.scenario, assembly, scoped(self.plant, body), allowed)

    def _may_overlap(self) -> frozenset[tuple[str, str]]:
        """Pairs that a movable joint connects, and pairs that the files exempt by collision filter groups."""
        pairs = {
            (scoped(self.plant, joint.parent_body()), scoped(self.plant, joint.child_body()))
            for joint in self.team.joints
        }
        models = [self.team.assembly.object_model, *(m for r in self.team.assembly.robots for m in r.models)]
        geometries = [
            (scoped(self.plant, body), self.plant.GetCollisionGeometriesForBody(body))
            for body in bodies_of(self.plant, models)
        ]
        for place, (first, ours) in enumerate(geometries):
            for second, theirs in geometries[place + 1 :]:
                filtered = (self.inspector.CollisionFiltered(a, b) for a in ours for b in theirs)
                if ours and theirs and all(filtered):
                    pairs.add((first, second))
        return frozenset(pairs)


def _checked(shape: ConvexShape) -> ConvexShape:
    extent = float(np.abs(shape.vertices).max()) + shape.radius
    if not extent <= _LARGEST:
        raise TypeError(f"it reaches {extent:.3g} m from its joint")
    return shape
