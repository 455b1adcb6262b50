"""The team as separate trees: the object and every robot, connected by weld constraints at the grasps."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pydrake.geometry import CollisionFilterDeclaration, GeometrySet, SceneGraph
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, DiscreteContactApproximation, MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, PlanarJoint, RigidBody
from pydrake.systems.framework import Context, DiagramBuilder

from coop_drake.plant.chain import find_base
from coop_drake.plant.constrained_grasps import ConstrainedGrasp, ConstrainedGrasps
from coop_drake.plant.fixing import fix_joints
from coop_drake.plant.parsing import add_models, finalize, set_actuators
from coop_drake.plant.planarity import object_frame, planar_pose
from coop_drake.plant.team import RobotModel, TeamPlant, build_team_plant
from coop_drake.scenario import Assembly, Scenario
from coop_drake.tree.pose import FloatArray


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
        grasp.constrain(plant)
    set_actuators(plant, [joint for _, joints in chains for joint in joints])
    finalize(scenario, plant)
    _let_nothing_touch(scene_graph)
    robots = tuple(
        replace(
            robot,
            model_instance=base.model_instance(),
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
