"""From every robot's effort to what the team's plant is driven by."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.framework import BasicVector, Context

from coop_drake.plant import RobotModel, TeamPlant
from coop_drake.systems.block import Block

__all__ = ["TeamActuation"]


class TeamActuation(Block):
    """Applies base wrenches as forces on the bases and joint torques at the joints.

    ======= ====================== ========= ========================================================= =====
    input   ``robot_<k>_effort``   3 + n_k   base wrench at Bk, joint torques of robot k [N, N m]      W
    output  ``base_wrenches``      abstract  one externally applied spatial force on every base        W
    output  ``joint_torques``      n         torques of all joints in the order of q [N m or N]
    ======= ====================== ========= ========================================================= =====

    No state. A base wrench given as a generalized force would move the team alike, but the grasp's reaction
    could not be read from the plant.

    Args:
        team: The team whose plant is driven.
    """

    def __init__(self, team: TeamPlant) -> None:
        super().__init__()
        self._forces = [_force_on(robot) for robot in team.robots]
        self._efforts = [
            self.DeclareVectorInputPort(f"robot_{robot.index}_effort", 3 + len(robot.joints))
            for robot in team.robots
        ]
        self._wrench = np.zeros(6)
        # Efforts that are held between samples need no new wrenches although time goes on.
        inputs = {self.all_input_ports_ticket()}
        self.DeclareAbstractOutputPort("base_wrenches", self._allocate, self._write_wrenches, inputs)
        self.DeclareVectorOutputPort("joint_torques", len(team.joints), self._write_torques, inputs)

    def _allocate(self) -> AbstractValue:
        return Value[list[ExternallyAppliedSpatialForce]]()

    def _write_wrenches(self, context: Context, output: AbstractValue) -> None:
        F = self._wrench
        for force, port in zip(self._forces, self._efforts, strict=True):
            effort = port.Eval(context)
            F[3], F[4], F[2] = effort[0], effort[1], effort[2]  # Drake's spatial order is rotation first
            force.F_Bq_W = SpatialForce(F)
        output.set_value(self._forces)

    def _write_torques(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(np.concatenate([port.Eval(context)[3:] for port in self._efforts]))


def _force_on(robot: RobotModel) -> ExternallyAppliedSpatialForce:
    force = ExternallyAppliedSpatialForce()
    force.body_index = robot.base_body.index()
    force.p_BoBq_B = np.zeros(3)
    return force
