"""One robot alone on the floor: what it knows of its own dynamics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    JacobianWrtVariable,
    Joint,
    ModelInstanceIndex,
    MultibodyForces,
    PlanarJoint,
    RigidBody,
    SpatialInertia,
)
from pydrake.systems.framework import Context

from coop_drake.plant.chain import find_base
from coop_drake.plant.fixing import fix_joints
from coop_drake.plant.parsing import add_models, bodies_of, finalize, set_actuators
from coop_drake.scenario import Scenario, assemble
from coop_drake.tree.pose import FloatArray

_PLANAR = [3, 4, 2]
"""Drake's spatial order is rotation first; the plane's is (x, y, rotation)."""


@dataclass(frozen=True)
class RobotPlant:
    """A robot's own model: z_k = (x, y, yaw, q_k...), its base on a planar joint, nothing in its hand.

    All matrices and vectors are ordered like z_k; wrenches and twists are planar, (x, y, rotation), in W.
    ``set_state`` first, then ask.

    Attributes:
        plant: Finalized, continuous time, without gravity or geometry.
        base_body: Bk.
        base_joint: Moves Bk against the world.
        joints: In the order of q_k.
        gripper_frame: Ek.
        context: The state that the answers are about.
        position_index: Where z_k's entries stand in the plant's positions, shape (3 + n_k,), integers.
        velocity_index: Where their rates stand in the plant's velocities, shape (3 + n_k,), integers.
    """

    plant: MultibodyPlant
    base_body: RigidBody
    base_joint: PlanarJoint
    joints: tuple[Joint, ...]
    gripper_frame: Frame
    context: Context
    position_index: Any
    velocity_index: Any

    def set_state(self, z: FloatArray, z_rate: FloatArray) -> None:
        """Set z_k and its rates, each of shape (3 + n_k,) [m, rad, 1/s]."""
        state = np.empty(2 * len(z))
        state[self.position_index] = z
        state[len(z) + self.velocity_index] = z_rate
        self.plant.SetPositionsAndVelocities(self.context, state)

    def scale_masses(self, factor: float) -> None:
        """Multiply mass and inertia of every body by a factor, as a model that is wrong about them has it."""
        for body in bodies_of(self.plant, self._models):
            inertia = body.CalcSpatialInertiaInBodyFrame(self.context)
            scaled = SpatialInertia(
                factor * inertia.get_mass(), inertia.get_com(), inertia.get_unit_inertia()
            )
            body.SetSpatialInertiaInBodyFrame(self.context, scaled)

    @property
    def _models(self) -> list[str]:
        models = range(2, self.plant.num_model_instances())  # after the world and Drake's default
        return [self.plant.GetModelInstanceName(ModelInstanceIndex(i)) for i in models]

    @cached_property
    def _order(self) -> Any:
        """Index that reorders the last axis; a slice, and so free, where Drake's order is z_k's already."""
        in_order = bool((self.velocity_index == np.arange(len(self.velocity_index))).all())
        return slice(None) if in_order else self.velocity_index

    @cached_property
    def _grasp_arguments(self) -> tuple[Any, ...]:
        world = self.plant.world_frame()
        return (JacobianWrtVariable.kV, self.gripper_frame, np.zeros(3), world, world)

    def mass_matrix(self) -> FloatArray:
        """M of (22), shape (3 + n_k, 3 + n_k) [kg, kg m, kg m^2]."""
        return self.plant.CalcMassMatrix(self.context)[self._order][:, self._order]

    def bias(self) -> FloatArray:
        """C z' + G of (22) with the joints' damping, shape (3 + n_k,) [N, N m]."""
        return self._inverse_dynamics(np.zeros(len(self.velocity_index)))

    def inertial_effort(self, acceleration: FloatArray) -> FloatArray:
        """M z'' + C z' + G with the joints' damping, without any wrench at the grasp.

        Args:
            acceleration: z'', shape (3 + n_k,).

        Returns:
            Base wrench in W and joint torques, shape (3 + n_k,) [N, N m].
        """
        ordered = np.empty(len(self.velocity_index))
        ordered[self.velocity_index] = acceleration
        return self._inverse_dynamics(ordered)

    def _inverse_dynamics(self, ordered_acceleration: FloatArray) -> FloatArray:
        forces = MultibodyForces(self.plant)
        self.plant.CalcForceElementsContribution(self.context, forces)
        effort: FloatArray = self.plant.CalcInverseDynamics(self.context, ordered_acceleration, forces)
        return effort[self._order]

    @cached_property
    def has_springs(self) -> bool:
        """Whether the model has force elements; gravity, which is zero, is one always."""
        return self.plant.num_force_elements() > 1

    def spring_effort(self) -> FloatArray:
        """What holds the model's force elements, the joints' damping aside, shape (3 + n_k,) [N, N m]."""
        forces = MultibodyForces(self.plant)
        self.plant.CalcForceElementsContribution(self.context, forces)
        rest = np.zeros(len(self.velocity_index))
        with_them = self.plant.CalcInverseDynamics(self.context, rest, forces)
        forces.SetZero()
        without = self.plant.CalcInverseDynamics(self.context, rest, forces)
        damping = [joint.GetDampingVector(self.context)[0] for joint in self.joints]
        rates = self.plant.GetVelocities(self.context)[self.velocity_index[3:]]
        effort: FloatArray = (with_them - without)[self._order]
        effort[3:] -= damping * rates
        return effort

    def grasp_jacobian(self) -> FloatArray:
        """J of E_k: planar twist of the grasp in W per rate of z_k, shape (3, 3 + n_k)."""
        return self.plant.CalcJacobianSpatialVelocity(self.context, *self._grasp_arguments)[_PLANAR][
            :, self._order
        ]

    def grasp_bias(self) -> FloatArray:
        """J' z' of E_k, planar in W, shape (3,) [m/s^2, rad/s^2]."""
        bias = self.plant.CalcBiasSpatialAcceleration(self.context, *self._grasp_arguments)
        return bias.get_coeffs()[_PLANAR]

    def grasp_pose(self) -> FloatArray:
        """Pose (x, y, angle) of E_k in W, shape (3,) [m, rad]."""
        X_WE = self.gripper_frame.CalcPoseInWorld(self.context)
        R, p = X_WE.rotation().matrix(), X_WE.translation()
        return np.array([p[0], p[1], np.arctan2(R[1, 0], R[0, 0])])


def build_robot_plant(scenario: Scenario, k: int) -> RobotPlant:
    """Build the model that robot k has of itself.

    Args:
        scenario: The scenario.
        k: Index of the robot in the scenario's order.

    Raises:
        ScenarioError: As for the team's plant.
    """
    assembly = assemble(scenario)
    robot = assembly.robots[k]
    plant = MultibodyPlant(0.0)
    add_models(scenario, assembly, assembly.of_robot(k), plant, None)
    fix_joints(scenario, assembly, plant)
    base, joints = find_base(scenario, robot, plant)
    base_joint = plant.AddJoint(PlanarJoint("base_pose", plant.world_frame(), base.body_frame()))
    set_actuators(plant, joints)
    finalize(scenario, plant)
    positions = [base_joint.position_start() + i for i in range(3)] + [j.position_start() for j in joints]
    velocities = [base_joint.velocity_start() + i for i in range(3)] + [j.velocity_start() for j in joints]
    return RobotPlant(
        plant,
        base,
        base_joint,
        joints,
        GetScopedFrameByName(plant, robot.gripper_frame),
        plant.CreateDefaultContext(),
        np.array(positions),
        np.array(velocities),
    )
