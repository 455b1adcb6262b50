"""The model that a robot has of itself: alone on the floor, with nothing in its hand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    Joint,
    ModelInstanceIndex,
    MultibodyForces,
    PlanarJoint,
    RigidBody,
    SpatialInertia,
)
from pydrake.systems.framework import Context

from coop_drake.plant.chain import find_base, fix_joints
from coop_drake.plant.parsing import add_models, bodies_of, finalize, read_once, set_actuators
from coop_drake.scenario import Scenario, assemble
from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class RobotPlant:
    """A robot's own model with the coordinates z_k = (x, y, yaw, q_k...); its base has a planar joint to W.

    Attributes:
        plant: Finalized, continuous time, without gravity or geometry.
        base_body: Bk.
        base_joint: Moves Bk against the world.
        joints: In the order of q_k.
        gripper_frame: Ek.
        context: Its state, see ``set_state``, and its masses.
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
        """Multiply mass and inertia of every body by a factor, to model a robot that errs about them."""
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
    def has_springs(self) -> bool:
        """Whether the model has force elements other than gravity, which every plant has."""
        return self.plant.num_force_elements() > 1

    def spring_effort(self) -> FloatArray:
        """Effort that balances the force elements without the joints' damping, shape (3 + n_k,) [N, N m]."""
        forces = MultibodyForces(self.plant)
        self.plant.CalcForceElementsContribution(self.context, forces)
        rest = np.zeros(len(self.velocity_index))
        with_them = self.plant.CalcInverseDynamics(self.context, rest, forces)
        forces.SetZero()
        without = self.plant.CalcInverseDynamics(self.context, rest, forces)
        damping = [joint.GetDampingVector(self.context)[0] for joint in self.joints]
        rates = self.plant.GetVelocities(self.context)[self.velocity_index[3:]]
        effort: FloatArray = (with_them - without)[self.velocity_index]
        effort[3:] -= damping * rates
        return effort


def build_robot_plant(scenario: Scenario, k: int) -> RobotPlant:
    """Build the model that robot k, in the scenario's order, has of itself.

    All models of one robot of a scenario share the plant, not its context.

    Raises:
        ScenarioError: As for the team's plant.
    """
    robot = _read_robot(scenario, k)
    return replace(robot, context=robot.plant.CreateDefaultContext())


@read_once
def _read_robot(scenario: Scenario, k: int) -> RobotPlant:
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
