"""The same question seen by somebody who stands elsewhere, in a mirror, or measures in another unit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np
from shapely.affinity import affine_transform

from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint


@dataclass(frozen=True)
class Similarity:
    """Mirror y, then turn, then scale, then shift.

    Attributes:
        angle: Turn [rad].
        shift: Displacement, in the new unit.
        mirror: Whether y changes its sign first.
        scale: New units per old one.
    """

    angle: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    mirror: bool = False
    scale: float = 1.0

    @property
    def sign(self) -> float:
        """Which way angles turn afterwards."""
        return -1.0 if self.mirror else 1.0

    def question(self, problem: PlanningProblem) -> PlanningProblem:
        """The whole question; lengths in its settings change their unit, too."""
        c, s = self.scale * cos(self.angle), self.scale * sin(self.angle)
        matrix = [c, -s * self.sign, s, c * self.sign, *self.shift]
        components = tuple(self._component(component) for component in problem.tree.components)
        settings = problem.settings
        return replace(
            problem,
            workspace=affine_transform(problem.workspace, matrix),
            tree=ComponentTree(components, problem.tree.unchecked_pairs),
            start=self._configuration(problem, problem.start),
            goal_pose=self._configuration(problem, problem.goal_pose),
            goal_joints=tuple(
                None if goal is None else goal * self._unit(joint)
                for goal, joint in zip(problem.goal_joints, problem.tree.joints, strict=True)
            ),
            position_tolerance=self.scale * problem.position_tolerance,
            settings=replace(
                settings,
                margin=self.scale * settings.margin,
                length_resolution=self.scale * settings.length_resolution,
            ),
        )

    def _configuration(self, problem: PlanningProblem, z: np.ndarray) -> np.ndarray:
        c, s = self.scale * cos(self.angle), self.scale * sin(self.angle)
        x, y, theta = z[0], self.sign * z[1], self.sign * z[2]
        pose = [c * x - s * y + self.shift[0], s * x + c * y + self.shift[1], theta + self.angle]
        units = [self._unit(joint) for joint in problem.tree.joints]
        return np.array([*pose, *(q * unit for q, unit in zip(z[3:], units, strict=False))])

    def _unit(self, joint: TreeJoint) -> float:
        return 1.0 if joint.kind == "revolute" else self.scale

    def _component(self, component: Component) -> Component:
        joint = None if component.joint is None else self._joint(component.joint)
        bodies = tuple(self._body(body) for body in component.bodies)
        return replace(component, joint=joint, bodies=bodies)

    def _joint(self, joint: TreeJoint) -> TreeJoint:
        X_PJ = joint.X_PJ
        return replace(
            joint,
            X_PJ=PlanarPose(self.scale * X_PJ.x, self.scale * self.sign * X_PJ.y, self.sign * X_PJ.angle),
            sign=self.sign * joint.sign,
            axis=(joint.axis[0], self.sign * joint.axis[1]),
            lower=self._unit(joint) * joint.lower,
            upper=self._unit(joint) * joint.upper,
        )

    def _body(self, body: Body) -> Body:
        shapes = []
        for shape in body.shapes:
            vertices = self.scale * shape.vertices * np.array([1.0, self.sign])
            shapes.append(ConvexShape(vertices[:: int(self.sign)].copy(), self.scale * shape.radius))
        return replace(body, shapes=tuple(shapes))
