"""The team as separate trees, with grasps as constraints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from pydrake.geometry import CollisionFilterDeclaration, GeometrySet, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, Frame, MultibodyForces, PlanarJoint, RigidBody
from pydrake.systems.framework import Context, DiagramBuilder

from coop_drake.plant.chain import find_base, fix_joints, object_frame, planar_pose
from coop_drake.plant.parsing import add_models, finalize, set_actuators
from coop_drake.plant.team import RobotModel, TeamPlant, build_team_plant
from coop_drake.scenario import Assembly, Scenario
from coop_drake.tree.arrays import FloatArray


class ConstrainedGrasp(NamedTuple):
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
        """As in :class:`coop_drake.plant.team.Grasps`, with the acceleration of the step that begins."""
        forces = MultibodyForces(self._plant)
        self._plant.CalcForceElementsContribution(context, forces)
        acceleration = self._plant.get_generalized_acceleration_output_port().Eval(context)
        needed = self._plant.CalcInverseDynamics(context, acceleration, forces)
        wrenches = self._on_bases(context) - np.array([needed[rows] for rows in self._rows])
        for wrench, grasp in zip(wrenches, self._grasps, strict=True):
            p_WE = grasp.gripper_frame.CalcPoseInWorld(context).translation()
            r = p_WE - grasp.base_joint.child_body().EvalPoseInWorld(context).translation()
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
        """As in :class:`coop_drake.plant.team.Grasps`: Ek of the end effector, and on the object."""
        found = [grasp.gripper_frame.CalcPoseInWorld(context).translation() for grasp in self._grasps]
        wanted = [g.object_body.EvalPoseInWorld(context).multiply(g.X_OE.translation()) for g in self._grasps]
        return np.linalg.norm(np.subtract(found, wanted), axis=1)


# The team as separate trees: the object and every robot, connected by weld constraints at the grasps.


@dataclass(frozen=True)
class SeparateTeam(TeamPlant):
    """A team whose plant has a tree for the object and one for every robot, in discrete time.

    z is (x, y, theta, q...) here too; the poses of the bases follow from it as long as the grasps hold.

    Attributes:
        tree: The same team as one tree rooted at the object.
        tree_context: Scratch context of that tree.
        base_joints: Move every Bk against the world.
    """

    tree: TeamPlant
    tree_context: Context
    base_joints: tuple[PlanarJoint, ...]

    @property
    def as_tree(self) -> TeamPlant:
        """The team as one tree rooted at the object, which the planner uses."""
        return self.tree

    def plant_state(self, z: FloatArray, z_rate: FloatArray) -> FloatArray:
        """Positions and velocities of the whole plant with every end effector exactly at its grasp.

        Args:
            z: (x, y, theta, q...), shape (3 + n,) [m, rad].
            z_rate: Rates of z, shape (3 + n,).
        """
        state = super().plant_state(z, z_rate)
        self.tree.plant.SetPositionsAndVelocities(self.tree_context, self.tree.plant_state(z, z_rate))
        for joint, robot in zip(self.base_joints, self.tree.robots, strict=True):
            X_WB = planar_pose(robot.base_body.EvalPoseInWorld(self.tree_context))
            V_WB = robot.base_body.EvalSpatialVelocityInWorld(self.tree_context).get_coeffs()
            at, rate_at = joint.position_start(), self.plant.num_positions() + joint.velocity_start()
            state[at : at + 3] = X_WB.x, X_WB.y, X_WB.angle
            state[rate_at : rate_at + 3] = V_WB[3], V_WB[4], V_WB[2]
        return state


def build_separate_team(scenario: Scenario, builder: DiagramBuilder) -> SeparateTeam:
    """Add a plant to a diagram in which the object and every robot are trees of their own.

    Each has a planar joint, and a weld constraint holds every end effector at its grasp. The plant computes
    no contact: clearances are checked elsewhere, and a run ends before bodies would touch.

    Args:
        scenario: The scenario; its ``plant.time_step`` is the plant's.
        builder: Receives plant and scene graph, connected to each other, finalized.

    Raises:
        ScenarioError: As for the team as one tree.
    """
    tree = build_team_plant(scenario, DiagramBuilder())
    zero, assembly = tree.plant.CreateDefaultContext(), tree.assembly
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, scenario.plant.time_step)
    # Constraints need a solver of the family SAP; accelerations shall be those of the present instant.
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
    plant.SetUseSampledOutputPorts(False)
    add_models(scenario, assembly, _without_grasps(assembly), plant, scene_graph)
    fix_joints(scenario, assembly, plant)
    frame = object_frame(scenario, assembly, plant)
    object_joint = plant.AddJoint(PlanarJoint("pose", plant.world_frame(), frame))
    chains = [find_base(scenario, robot, plant) for robot in assembly.robots]
    base_joints = tuple(
        _add_base_joint(plant, base, robot, zero)
        for (base, _), robot in zip(chains, tree.robots, strict=True)
    )
    grasps = [
        _grasp(tree, robot, zero, plant, joint) for robot, joint in zip(tree.robots, base_joints, strict=True)
    ]
    for grasp in grasps:
        gripper = grasp.gripper_frame
        X_GE = gripper.GetFixedPoseInBodyFrame()
        plant.AddWeldConstraint(grasp.object_body, grasp.X_OE, gripper.body(), X_GE)
    set_actuators(plant, [joint for _, joints in chains for joint in joints])
    finalize(scenario, plant)
    _let_nothing_touch(scene_graph)
    robots = tuple(
        replace(
            robot,
            base_body=base,
            joints=joints,
            gripper_frame=grasp.gripper_frame,
        )
        for robot, (base, joints), grasp in zip(tree.robots, chains, grasps, strict=True)
    )
    return SeparateTeam(
        plant=plant,
        scene_graph=scene_graph,
        object_body=frame.body(),
        object_frame=frame,
        object_joint=object_joint,
        object_inertia=tree.object_inertia,
        robots=robots,
        grasps=ConstrainedGrasps(plant, grasps),
        assembly=assembly,
        scenario=scenario,
        tree=tree,
        tree_context=zero,
        base_joints=base_joints,
    )


def _without_grasps(assembly: Assembly) -> list[int]:
    """Indices of all directives but the robots' welds to the object."""
    grasps = {(robot.object_frame, robot.gripper_frame) for robot in assembly.robots}
    welds = [directive.add_weld for directive in assembly.directives]
    return [i for i, weld in enumerate(welds) if not (weld and (weld.parent, weld.child) in grasps)]


def _add_base_joint(plant: MultibodyPlant, base: RigidBody, robot: RobotModel, zero: Context) -> PlanarJoint:
    """Let a base move on the floor at the height, and with the tilt, that it has in the tree."""
    X_WB = robot.base_body.EvalPoseInWorld(zero)
    flat = planar_pose(X_WB)
    X_WF = RigidTransform([0.0, 0.0, X_WB.translation()[2]])
    X_FM = RigidTransform(RotationMatrix.MakeZRotation(flat.angle), [flat.x, flat.y, 0.0])
    X_BM = X_WB.InvertAndCompose(X_WF @ X_FM)
    name = f"{robot.name}_pose"
    on_world = plant.AddFrame(FixedOffsetFrame(f"{name}_floor", plant.world_frame(), X_WF))
    on_base = plant.AddFrame(FixedOffsetFrame(f"{name}_base", base.body_frame(), X_BM))
    return plant.AddJoint(PlanarJoint(name, on_world, on_base))


def _grasp(
    tree: TeamPlant, robot: RobotModel, zero: Context, plant: MultibodyPlant, base_joint: PlanarJoint
) -> ConstrainedGrasp:
    names = tree.assembly.robots[robot.index]
    grasped = GetScopedFrameByName(tree.plant, names.object_frame).body()
    return ConstrainedGrasp(
        gripper_frame=GetScopedFrameByName(plant, names.gripper_frame),
        object_body=GetScopedFrameByName(plant, names.object_frame).body(),
        X_OE=robot.gripper_frame.CalcPose(zero, grasped.body_frame()),
        base_joint=base_joint,
    )


def _let_nothing_touch(scene_graph: SceneGraph) -> None:
    everything = GeometrySet(scene_graph.model_inspector().GetAllGeometryIds())
    scene_graph.collision_filter_manager().Apply(CollisionFilterDeclaration().ExcludeWithin(everything))
