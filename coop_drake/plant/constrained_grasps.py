"""Grasps that are constraints between bodies of different trees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, MultibodyForces, PlanarJoint, RigidBody
from pydrake.systems.framework import Context

from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class ConstrainedGrasp:
    """One robot's hold on the object.

    Attributes:
        gripper_frame: Ek, fixed on the robot's end effector.
        object_body: The object's body that is grasped.
        X_OE: Pose of Ek on that body while the grasp holds.
        base_joint: Moves Bk against the world.
    """

    gripper_frame: Frame
    object_body: RigidBody
    X_OE: RigidTransform
    base_joint: PlanarJoint

    def constrain(self, plant: MultibodyPlant) -> None:
        """Add the constraint that welds end effector and object; the plant must not be finalized yet."""
        gripper = self.gripper_frame
        plant.AddWeldConstraint(
            self.object_body, self.X_OE, gripper.body(), gripper.GetFixedPoseInBodyFrame()
        )

    def error(self, context: Context) -> float:
        """Distance between Ek on the end effector and on the object [m]."""
        p_WE = self.gripper_frame.CalcPoseInWorld(context).translation()
        wanted = self.object_body.EvalPoseInWorld(context).multiply(self.X_OE.translation())
        return float(np.linalg.norm(p_WE - wanted))

    def lever(self, context: Context) -> FloatArray:
        """Vector from Bk to Ek in W, shape (2,) [m]."""
        p_WE = self.gripper_frame.CalcPoseInWorld(context).translation()
        p_WB = self.base_joint.child_body().EvalPoseInWorld(context).translation()
        return (p_WE - p_WB)[:2]


class ConstrainedGrasps:
    """Grasps that are weld constraints, which are nearly rigid.

    Drake does not report the forces of a constraint. The wrench on the object is what acts on the base less
    the force that the robot's own motion takes.

    Args:
        plant: Finalized.
        grasps: One for each robot, in the scenario's order.
    """

    def __init__(self, plant: MultibodyPlant, grasps: Sequence[ConstrainedGrasp]) -> None:
        self._plant, self._grasps = plant, tuple(grasps)
        self._rows = [grasp.base_joint.velocity_start() + np.arange(3) for grasp in grasps]

    def wrenches(self, context: Context) -> FloatArray:
        """As in :class:`coop_drake.plant.grasps.Grasps`, with the acceleration of the step that begins."""
        forces = MultibodyForces(self._plant)
        self._plant.CalcForceElementsContribution(context, forces)
        acceleration = self._plant.get_generalized_acceleration_output_port().Eval(context)
        needed = self._plant.CalcInverseDynamics(context, acceleration, forces)
        wrenches = self._on_bases(context) - np.array([needed[rows] for rows in self._rows])
        for wrench, grasp in zip(wrenches, self._grasps, strict=True):
            r = grasp.lever(context)
            wrench[2] -= r[0] * wrench[1] - r[1] * wrench[0]
        return wrenches

    def _on_bases(self, context: Context) -> FloatArray:
        """Return the wrench on every base at Bk in W: the robot's, friction and pushes, shape (N, 3)."""
        sums = {int(grasp.base_joint.child_body().index()): np.zeros(6) for grasp in self._grasps}
        for force in self._plant.get_applied_spatial_force_input_port().Eval(context):
            if int(force.body_index) in sums:  # forces on bases act at Bk
                sums[int(force.body_index)] += force.F_Bq_W.get_coeffs()
        return np.array([(total[3], total[4], total[2]) for total in sums.values()])

    def errors(self, context: Context) -> FloatArray:
        """As in :class:`coop_drake.plant.grasps.Grasps`."""
        return np.array([grasp.error(context) for grasp in self._grasps])
