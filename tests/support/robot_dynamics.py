"""A robot's dynamics in matrices, as Drake computes them: what the compiled laws are compared with."""

from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
from pydrake.multibody.tree import JacobianWrtVariable, MultibodyForces

from coop_drake.plant import RobotPlant, build_robot_plant
from coop_drake.scenario import Scenario
from coop_drake.tree.arrays import FloatArray

_PLANAR = [3, 4, 2]
"""Drake's spatial order is rotation first; the plane's is (x, y, rotation)."""


class RobotDynamics(RobotPlant):
    """A robot's own model with its equations of motion (22); call ``set_state`` first.

    All matrices and vectors are ordered like z_k; wrenches and twists are planar, (x, y, rotation), in W.
    """

    @cached_property
    def _grasp_arguments(self) -> tuple[Any, ...]:
        world = self.plant.world_frame()
        return (JacobianWrtVariable.kV, self.gripper_frame, np.zeros(3), world, world)

    def mass_matrix(self) -> FloatArray:
        """M of (22), shape (3 + n_k, 3 + n_k) [kg, kg m, kg m^2]."""
        return self.plant.CalcMassMatrix(self.context)[np.ix_(self.velocity_index, self.velocity_index)]

    def inertial_effort(self, acceleration: FloatArray) -> FloatArray:
        """M z'' + C z' + G with the joints' damping, without any wrench at the grasp.

        Args:
            acceleration: z'', shape (3 + n_k,).

        Returns:
            Base wrench in W and joint torques, shape (3 + n_k,) [N, N m].
        """
        ordered = np.empty(len(self.velocity_index))
        ordered[self.velocity_index] = acceleration
        forces = MultibodyForces(self.plant)
        self.plant.CalcForceElementsContribution(self.context, forces)
        effort: FloatArray = self.plant.CalcInverseDynamics(self.context, ordered, forces)
        return effort[self.velocity_index]

    def grasp_jacobian(self) -> FloatArray:
        """J of E_k: planar twist of the grasp in W per rate of z_k, shape (3, 3 + n_k)."""
        return self.plant.CalcJacobianSpatialVelocity(self.context, *self._grasp_arguments)[_PLANAR][
            :, self.velocity_index
        ]

    def grasp_bias(self) -> FloatArray:
        """J' z' of E_k, planar in W, shape (3,) [m/s^2, rad/s^2]."""
        bias = self.plant.CalcBiasSpatialAcceleration(self.context, *self._grasp_arguments)
        return bias.get_coeffs()[_PLANAR]


def robot_dynamics(scenario: Scenario, k: int) -> RobotDynamics:
    """The model that robot k has of itself."""
    robot = build_robot_plant(scenario, k)
    return RobotDynamics(**{field.name: getattr(robot, field.name) for field in fields(robot)})
