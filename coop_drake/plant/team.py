"""The team as one plant, rooted at the object, its configurations, and every robot's model of itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    FrameIndex,
    Joint,
    JointIndex,
    ModelInstanceIndex,
    MultibodyForces,
    PlanarJoint,
    RigidBody,
    SpatialInertia,
    WeldJoint,
)
from pydrake.systems.framework import Context, DiagramBuilder

from coop_drake.plant import parsing
from coop_drake.plant.chain import (
    check_masses,
    check_planar,
    find_base,
    fix_joints,
    object_frame,
    planar_pose,
    scoped,
)
from coop_drake.scenario import Assembly, Deployment, RobotAssembly, Scenario, assemble
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import PlanarPose

# The team as one plant, rooted at the object.


class Grasps(Protocol):
    """The grasps of all robots, in the scenario's order."""

    def wrenches(self, context: Context) -> FloatArray:
        """Wrench on the object at every Ek in W, shape (N, 3) [N, N m].

        Args:
            context: The plant's, inside the diagram's, all inputs connected.
        """
        ...

    def errors(self, context: Context) -> FloatArray:
        """Distance between every robot's Ek and the same point of the object, shape (N,) [m]."""
        ...


class WeldedGrasps:
    """Grasps that are joints of one tree: they are exact, and their wrenches are the joints' reactions.

    Args:
        plant: Finalized.
        robots: The frames of every grasp; the object is its parent.
    """

    def __init__(self, plant: MultibodyPlant, robots: Sequence[RobotAssembly]) -> None:
        self._reactions = plant.get_reaction_forces_output_port()
        welds = [_weld(plant, robot) for robot in robots]
        self._places = [place for place, _ in welds]
        self._frames = [weld.frame_on_child() for _, weld in welds]

    def wrenches(self, context: Context) -> FloatArray:
        """As in :class:`Grasps`; the reaction on a weld's child acts on the robot, in the joint's frame."""
        reactions = self._reactions.Eval(context)
        rows = [
            reactions[place].Rotate(frame.CalcRotationMatrixInWorld(context)).get_coeffs()
            for place, frame in zip(self._places, self._frames, strict=True)
        ]
        return np.array([(-row[3], -row[4], -row[2]) for row in rows])

    def errors(self, context: Context) -> FloatArray:
        """As in :class:`Grasps`; zero, because the end effectors are bodies of the object's tree."""
        return np.zeros(len(self._places))


def _weld(plant: MultibodyPlant, robot: RobotAssembly) -> tuple[int, WeldJoint]:
    """A robot's grasp, and its place in the plant's ``reaction_forces`` output."""
    ends = {
        int(GetScopedFrameByName(plant, frame).body().index())
        for frame in (robot.gripper_frame, robot.object_frame)
    }
    return next(
        (place, joint)
        for place, joint in enumerate(parsing.joints_of(plant))
        if joint.type_name() == "weld"
        and {int(joint.parent_body().index()), int(joint.child_body().index())} == ends
    )


# The whole team as one tree rooted at the object: the plant that is simulated.


@dataclass(frozen=True)
class ObjectInertia:
    """Mass properties of the object in the plane.

    Attributes:
        mass: M_L [kg].
        inertia_about_com: I_L, about the vertical axis through the centre of mass [kg m^2].
        p_LLcm: Centre of mass in the object's frame, shape (2,) [m].
    """

    mass: float
    inertia_about_com: float
    p_LLcm: FloatArray  # noqa: N815

    def scaled(self, factor: float) -> ObjectInertia:
        """Return this inertia with mass and rotational inertia multiplied by a factor."""
        return ObjectInertia(factor * self.mass, factor * self.inertia_about_com, self.p_LLcm)


@dataclass(frozen=True)
class RobotModel:
    """One robot inside the team's plant.

    Attributes:
        index: k, its place in the team.
        name: Name of the model that its base belongs to.
        base_body: Bk, the body that the base wrench acts on.
        joints: In the order of q_k, from the base outwards.
        joint_names: Their scoped names.
        gripper_frame: Ek, fixed on the robot's end effector.
        X_LE: Pose of the grasp in the object's frame.
        q_slice: Where q_k stands in q.
    """

    index: int
    name: str
    base_body: RigidBody
    joints: tuple[Joint, ...]
    joint_names: tuple[str, ...]
    gripper_frame: Frame
    X_LE: PlanarPose
    q_slice: slice


def base_inertia(robot: RobotModel) -> tuple[float, float]:
    """Return the mass of a robot's base [kg], and its inertia about the vertical axis through Bk [kg m^2]."""
    inertia = robot.base_body.default_spatial_inertia()
    return float(inertia.get_mass()), float(inertia.CalcRotationalInertia().get_moments()[2])


@dataclass(frozen=True)
class TeamPlant:
    """The team's plant, its tree rooted at the object; z = (x, y, theta, q...).

    The actuation input takes the joint torques in q's order. Base wrenches go in as
    ``ExternallyAppliedSpatialForce`` on each ``base_body``.

    Attributes:
        plant: Finalized, continuous time, without gravity.
        scene_graph: The geometry of the same diagram.
        object_body: The body that the object's planar joint moves.
        object_frame: L, z upwards.
        object_joint: Moves L against the world; its coordinates are (x, y, theta).
        object_inertia: Mass properties of the object.
        robots: In the scenario's order.
        grasps: Reads wrenches and errors of the grasps.
        assembly: The object and the robots in the directives.
        scenario: What it was built from.
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    object_body: RigidBody
    object_frame: Frame
    object_joint: PlanarJoint
    object_inertia: ObjectInertia
    robots: tuple[RobotModel, ...]
    grasps: Grasps
    assembly: Assembly
    scenario: Scenario

    @property
    def as_tree(self) -> TeamPlant:
        """The team as one tree rooted at the object, which the planner uses."""
        return self

    def plant_state(self, z: FloatArray, z_rate: FloatArray) -> FloatArray:
        """Positions and velocities of the whole plant.

        Args:
            z: (x, y, theta, q...), shape (3 + n,) [m, rad].
            z_rate: Rates of z, shape (3 + n,).
        """
        state = np.zeros(self.plant.num_multibody_states())
        state[self.position_index] = z
        state[self.plant.num_positions() + self.velocity_index] = z_rate
        return state

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """All joints in the order of q."""
        return tuple(joint for robot in self.robots for joint in robot.joints)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Scoped names of q's entries."""
        return tuple(name for robot in self.robots for name in robot.joint_names)

    @cached_property
    def position_index(self) -> Any:
        """Where z's entries stand in the plant's positions, shape (3 + n,), integers."""
        start = self.object_joint.position_start()
        return np.array([start, start + 1, start + 2, *(j.position_start() for j in self.joints)])

    @cached_property
    def velocity_index(self) -> Any:
        """Where the rates of z stand in the plant's velocities, shape (3 + n,), integers."""
        start = self.object_joint.velocity_start()
        return np.array([start, start + 1, start + 2, *(j.velocity_start() for j in self.joints)])


def build_team_plant(scenario: Scenario, builder: DiagramBuilder) -> TeamPlant:
    """Add plant and scene graph of the whole team, connected to each other and finalized, to a diagram.

    The plant lives as long as the builder's diagram.

    Raises:
        ScenarioError: The models do not make a team of holonomic planar manipulators that hold one object.
    """
    assembly, read, geometry, of_frame, of_joint = _read_team(scenario)
    plant, scene_graph = parsing.add_copy(builder, read, geometry)
    frame, context = plant.get_frame(of_frame), plant.CreateDefaultContext()
    robots: list[RobotModel] = []
    for robot in assembly.robots:
        first = robots[-1].q_slice.stop if robots else 0
        base, joints = find_base(scenario, robot, plant)
        gripper = GetScopedFrameByName(plant, robot.gripper_frame)
        robots.append(
            RobotModel(
                index=len(robots),
                name=robot.name,
                base_body=base,
                joints=joints,
                joint_names=tuple(scoped(plant, joint) for joint in joints),
                gripper_frame=gripper,
                X_LE=planar_pose(gripper.CalcPose(context, frame)),
                q_slice=slice(first, first + len(joints)),
            )
        )
    return TeamPlant(
        plant=plant,
        scene_graph=scene_graph,
        object_body=frame.body(),
        object_frame=frame,
        object_joint=plant.get_joint(of_joint),
        object_inertia=_object_inertia(
            plant, context, parsing.bodies_of(plant, [assembly.object_model]), frame
        ),
        robots=tuple(robots),
        grasps=WeldedGrasps(plant, assembly.robots),
        assembly=assembly,
        scenario=scenario,
    )


@parsing.read_once
def _read_team(
    scenario: Scenario,
) -> tuple[Assembly, MultibodyPlant, SceneGraph, FrameIndex, JointIndex]:
    """Return object and robots, plant and geometry in no diagram, L, and the joint that moves L."""
    assembly = assemble(scenario)
    plant, scene_graph = MultibodyPlant(0.0), SceneGraph()
    plant.set_name("plant")
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    parsing.add_models(scenario, assembly, range(len(assembly.directives)), plant, scene_graph)
    fix_joints(scenario, assembly, plant)
    frame = object_frame(scenario, assembly, plant)
    object_joint = plant.AddJoint(PlanarJoint("pose", plant.world_frame(), frame))
    chains = [find_base(scenario, robot, plant) for robot in assembly.robots]
    parsing.set_actuators(plant, [joint for _, joints in chains for joint in joints])
    parsing.finalize(scenario, plant)
    context = plant.CreateDefaultContext()
    check_planar(scenario, assembly, plant, context, chains)
    check_masses(scenario, assembly, plant, context)
    return assembly, plant, scene_graph, frame.index(), object_joint.index()


def _object_inertia(
    plant: MultibodyPlant, context: Context, bodies: list[RigidBody], frame: Frame
) -> ObjectInertia:
    indices = [body.index() for body in bodies]
    inertia = plant.CalcSpatialInertia(context, frame, indices)
    p_LLcm = inertia.get_com()
    about_com = inertia.Shift(p_LLcm).CalcRotationalInertia().get_moments()[2]
    return ObjectInertia(float(inertia.get_mass()), float(about_com), np.array(p_LLcm[:2]))


# Writes configurations z of the team into a plant's context, and reads the bases' poses from it.


def set_configuration(
    team: TeamPlant, context: Context, z: FloatArray, z_rate: FloatArray | None = None
) -> None:
    """Put the team into a configuration.

    Args:
        team: The team.
        context: The plant's context.
        z: (x, y, theta, q...), shape (3 + n,) [m, rad].
        z_rate: Rates of z, shape (3 + n,); at rest if None.
    """
    rates = np.zeros(len(z)) if z_rate is None else z_rate
    team.plant.SetPositionsAndVelocities(context, team.plant_state(z, rates))


def base_poses(team: TeamPlant, context: Context) -> FloatArray:
    """Read the pose (x, y, angle) of every base in W, shape (N, 3) [m, rad], angles in (-pi, pi]."""
    poses = [planar_pose(robot.base_body.EvalPoseInWorld(context)) for robot in team.robots]
    return np.array([(pose.x, pose.y, pose.angle) for pose in poses])


def displacement(deployment: Deployment, axes: int) -> FloatArray:
    """Return how far a team with so many (x, y, theta, q...) stands away from the plan's start [m, rad]."""
    offset = deployment.start_offset
    return np.array([offset.x, offset.y, offset.theta, *(offset.joints or (0.0,) * (axes - 3))])


# The model that a robot has of itself: alone on the floor, with nothing in its hand.


@dataclass(frozen=True)
class RobotPlant:
    """A robot's own model with the coordinates z_k = (x, y, yaw, q_k...); its base has a planar joint to W.

    Attributes:
        plant: Finalized, continuous time, without gravity or geometry.
        base_body: Bk.
        joints: In the order of q_k.
        gripper_frame: Ek.
        context: Its state, see ``set_state``, and its masses.
        position_index: Where z_k's entries stand in the plant's positions, shape (3 + n_k,), integers.
        velocity_index: Where their rates stand in the plant's velocities, shape (3 + n_k,), integers.
    """

    plant: MultibodyPlant
    base_body: RigidBody
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
        for body in parsing.bodies_of(self.plant, self._models):
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


@parsing.read_once
def _read_robot(scenario: Scenario, k: int) -> RobotPlant:
    assembly = assemble(scenario)
    robot = assembly.robots[k]
    plant = MultibodyPlant(0.0)
    parsing.add_models(scenario, assembly, assembly.of_robot(k), plant, None)
    fix_joints(scenario, assembly, plant)
    base, joints = find_base(scenario, robot, plant)
    base_joint = plant.AddJoint(PlanarJoint("base_pose", plant.world_frame(), base.body_frame()))
    parsing.set_actuators(plant, joints)
    parsing.finalize(scenario, plant)
    positions = [base_joint.position_start() + i for i in range(3)] + [j.position_start() for j in joints]
    velocities = [base_joint.velocity_start() + i for i in range(3)] + [j.velocity_start() for j in joints]
    return RobotPlant(
        plant,
        base,
        joints,
        GetScopedFrameByName(plant, robot.gripper_frame),
        plant.CreateDefaultContext(),
        np.array(positions),
        np.array(velocities),
    )
