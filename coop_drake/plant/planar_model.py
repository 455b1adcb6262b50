"""Models in the plane as arrays, the form of the compiled laws: chains of robots, the tree of a team."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Frame, Joint, RigidBody
from pydrake.systems.framework import Context

from coop_drake.laws.robot_dynamics import (
    COLUMNS,
    COM_X,
    COM_Y,
    DAMPING,
    INERTIA,
    MASS,
    PARENT,
    POSITION,
    RATE,
    ROTOR,
    SLIDE_X,
    SLIDE_Y,
    TURN,
    X,
    Y,
)
from coop_drake.plant.component_tree import base_components, component_bodies
from coop_drake.plant.team import RobotModel, RobotPlant, TeamPlant
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import ComponentTree

# Reads planar chains, the form that the compiled laws take, from Drake's models.


@dataclass(frozen=True)
class BaseChain:
    """The chain from the object through a robot's grasp and joints to its base.

    Attributes:
        chain: Rows as in ``coop_drake.laws.robot_dynamics``, the object first, the base's frame last.
        yaw: Angle of the base in the object where all joints are at zero [rad].
        joints: Where the robot's joints and their rates stand in the team's state, shape (2, n).
    """

    chain: FloatArray
    yaw: float
    joints: IntArray

    @property
    def mounting(self) -> FloatArray:
        """The yaw, then what a unit of every joint turns the base by in the object [-], shape (1 + n,)."""
        turns = dict(zip(self.chain[1:-1, POSITION], self.chain[1:-1, TURN], strict=True))
        return np.array([self.yaw, *(turns.get(place, 0.0) for place in self.joints[0])])


def robot_chain(robot: RobotPlant) -> FloatArray:
    """The chain of a robot's own model, from its base to its end effector; masses are those of its context.

    Returns:
        Shape (n + 2, ``COLUMNS``), joints in the order of q_k, their places those in (z_k, z_k').
    """
    plant, n = robot.plant, len(robot.joints)
    context = _at_zero(plant, robot.context)
    chain = np.zeros((n + 2, COLUMNS))
    link_of: dict[int, int] = {}
    for row, body in enumerate([robot.base_body, *(joint.child_body() for joint in robot.joints)]):
        welded = plant.GetBodiesWeldedTo(body)
        link_of.update({int(part.index()): row for part in welded})
        chain[row, [MASS, COM_X, COM_Y, INERTIA]] = bodies_inertia(plant, context, welded)
    chain[0, RATE] = 3 + n
    for row, joint in enumerate(robot.joints, 1):
        chain[row, [X, Y, TURN, SLIDE_X, SLIDE_Y]] = _joint(context, joint)
        chain[row, PARENT] = link_of[int(joint.parent_body().index())]
        chain[row, [POSITION, RATE]] = 2 + row, 5 + n + row
        chain[row, DAMPING] = joint.GetDampingVector(context)[0]
        chain[row, ROTOR] = rotor_inertia(plant, context, joint)
    chain[-1, [X, Y]] = _origin(context, robot.gripper_frame)
    chain[-1, PARENT] = link_of[int(robot.gripper_frame.body().index())]
    return chain


def base_chain(team: TeamPlant, robot: RobotModel) -> BaseChain:
    """The chain from the object to a robot's base in the team's plant, whose tree begins at the object."""
    plant = team.plant
    context = _at_zero(plant, plant.CreateDefaultContext())
    rates = plant.num_positions()
    path = _to_base(plant, robot)
    chain = np.zeros((len(path) + 2, COLUMNS))
    pose = team.object_joint
    chain[0, [POSITION, RATE]] = pose.position_start(), rates + pose.velocity_start()
    for row, joint in enumerate(path, 1):
        x, y, *motion = _joint(context, joint)
        chain[row, [X, Y, TURN, SLIDE_X, SLIDE_Y]] = x, y, *(-part for part in motion)  # from gripper to base
        chain[row, PARENT] = row - 1
        chain[row, [POSITION, RATE]] = joint.position_start(), rates + joint.velocity_start()
    chain[-1, [X, Y]] = _origin(context, robot.base_body.body_frame())
    chain[-1, PARENT] = len(path)
    R = robot.base_body.EvalPoseInWorld(context).rotation().matrix()
    places = [(joint.position_start(), rates + joint.velocity_start()) for joint in robot.joints]
    joints = np.array(places, dtype=np.int64).reshape(-1, 2).T
    return BaseChain(chain, float(np.arctan2(R[1, 0], R[0, 0])), np.ascontiguousarray(joints))


def _to_base(plant: MultibodyPlant, robot: RobotModel) -> list[Joint]:
    """The joints between a robot's end effector and its base, the outermost first."""
    leading = {
        int(body.index()): joint
        for joint in robot.joints
        for body in plant.GetBodiesWeldedTo(joint.child_body())
    }
    path, body = [], robot.gripper_frame.body()
    while (joint := leading.get(int(body.index()))) is not None:
        path.append(joint)
        body = joint.parent_body()
    return path


def _at_zero(plant: MultibodyPlant, context: Context) -> Context:
    """A copy of a context with all positions and velocities zero."""
    copy = context.Clone()
    plant.SetPositionsAndVelocities(copy, np.zeros(plant.num_multibody_states()))
    return copy


def _origin(context: Context, frame: Frame) -> FloatArray:
    return frame.CalcPoseInWorld(context).translation()[:2]


def _joint(context: Context, joint: Joint) -> tuple[float, float, float, float, float]:
    """Position of a joint, the sense of its rotation (0 if prismatic) and its direction (0 if revolute)."""
    X_WF = joint.frame_on_parent().CalcPoseInWorld(context)
    x, y, _ = X_WF.translation()
    revolute = joint.type_name() == "revolute"
    axis = X_WF.rotation().matrix() @ (joint.revolute_axis() if revolute else joint.translation_axis())
    if revolute:
        return float(x), float(y), float(np.sign(axis[2])), 0.0, 0.0
    return float(x), float(y), 0.0, float(axis[0]), float(axis[1])


def bodies_inertia(
    plant: MultibodyPlant, context: Context, bodies: list[RigidBody]
) -> tuple[float, float, float, float]:
    """Mass, centre of mass in W and inertia about it of bodies that do not move against each other."""
    whole = plant.CalcSpatialInertia(context, plant.world_frame(), [body.index() for body in bodies])
    if whole.get_mass() == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    com = whole.get_com()
    about_com = whole.Shift(com).CalcRotationalInertia().get_moments()[2]
    return float(whole.get_mass()), float(com[0]), float(com[1]), float(about_com)


def rotor_inertia(plant: MultibodyPlant, context: Context, joint: Joint) -> float:
    """Reflected inertia of the rotors that drive a joint."""
    actuators = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return sum(
        float(actuator.calc_reflected_inertia(context))
        for actuator in actuators
        if actuator.joint().index() == joint.index()
    )


# Reads the whole team as one planar tree with masses, the form that ``laws/team_dynamics.py`` takes.


@dataclass(frozen=True)
class TeamTree:
    """The team's plant in the plane, its positions and rates in the order of the plant's own state.

    Attributes:
        tree: The object in row 0, then a row for each component, shape (1 + n, ``COLUMNS``).
        bases: Row of every robot's base, then that of the object, shape (N + 1,).
        places: Where wrenches act on these, in the object's frame with all joints at zero: the origins of the
            bases and of the object, shape (N + 1, 2) [m].
        strongest: Largest effort of every joint that its model allows, in the order of q, shape (n,) [N m or
            N].
    """

    tree: FloatArray
    bases: IntArray
    places: FloatArray
    strongest: FloatArray


def read_team_tree(team: TeamPlant, components: ComponentTree) -> TeamTree:
    """Read a team's plant.

    Args:
        team: A team of robots as one tree.
        components: Its component tree.
    """
    plant, context = team.plant, team.plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, np.zeros(plant.num_multibody_states()))
    rates, (groups, origins) = plant.num_positions(), component_bodies(team, components)
    rows = np.zeros((len(groups), COLUMNS))
    pose = team.object_joint
    rows[0, [POSITION, RATE]] = pose.position_start(), rates + pose.velocity_start()
    for row, group, origin, component in zip(rows, groups, origins, components.components, strict=True):
        bodies = [plant.get_body(BodyIndex(i)) for i in sorted(group)]
        row[[MASS, COM_X, COM_Y, INERTIA]] = bodies_inertia(plant, context, bodies)
        row[[X, Y]] = origin
        if (moved := component.joint) is not None:
            joint, turns = team.joints[moved.index], moved.kind == "revolute"
            row[[PARENT, TURN]] = component.parent, moved.sign if turns else 0.0
            row[[SLIDE_X, SLIDE_Y]] = moved.axis
            row[[POSITION, RATE]] = joint.position_start(), rates + joint.velocity_start()
            row[DAMPING] = joint.GetDampingVector(context)[0]
            row[ROTOR] = rotor_inertia(plant, context, joint)
    places = [robot.base_body.EvalPoseInWorld(context).translation()[:2] for robot in team.robots]
    drives = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    limit_of = {int(drive.joint().index()): drive.effort_limit() for drive in drives}
    strongest = np.array([limit_of.get(int(joint.index()), np.inf) for joint in team.joints], dtype=float)
    return TeamTree(
        rows,
        np.array([*base_components(team, groups), 0], dtype=np.int64),
        np.array([*places, np.zeros(2)]),
        strongest,
    )
