"""Planarity checks: bases stand upright, revolute axes are vertical and prismatic axes are horizontal."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, RigidBody
from pydrake.systems.framework import Context

from coop_drake.plant.chain import scoped
from coop_drake.plant.parsing import bodies_of, joints_of, refusal
from coop_drake.scenario import Assembly, Scenario
from coop_drake.tree.pose import FloatArray, PlanarPose

TILT = 1e-5
"""Largest sine of a tilt that counts as rounding in a file: pi / 2 with six digits is accepted [-]."""


def planar_pose(X: RigidTransform) -> PlanarPose:
    """The planar part of a pose whose rotation is about the vertical axis."""
    R, p = X.rotation().matrix(), X.translation()
    return PlanarPose(float(p[0]), float(p[1]), float(np.arctan2(R[1, 0], R[0, 0])))


def is_upright(axis: FloatArray) -> bool:
    """Whether a unit vector points along the vertical, up or down."""
    return bool(np.hypot(axis[0], axis[1]) <= TILT)


def object_frame(scenario: Scenario, assembly: Assembly, plant: MultibodyPlant) -> Frame:
    """Find L: the frame of the object's model, or of its root body where the file format has no model frame.

    Raises:
        ScenarioError: The object has movable joints, a joint to the world, or several loose bodies.
    """
    instance = plant.GetModelInstanceByName(assembly.object_model)
    refuse = partial(refusal, scenario, None)
    bodies = bodies_of(plant, [assembly.object_model])
    members = {int(body.index()) for body in bodies}
    children = set()
    for joint in joints_of(plant):
        ends = {int(joint.parent_body().index()), int(joint.child_body().index())}
        if not ends & members:
            continue
        if int(plant.world_body().index()) in ends:
            raise refuse(scoped(plant, joint), "an object that no joint ties to the world")
        if ends <= members:
            if joint.type_name() != "weld":
                raise refuse(scoped(plant, joint), "an object that is rigid: fixed joints only")
            children.add(int(joint.child_body().index()))
    roots = [body for body in bodies if int(body.index()) not in children]
    if len(roots) != 1:
        names = ", ".join(scoped(plant, body) for body in roots) or "none"
        raise refuse(names, "an object whose bodies hang together")
    if plant.HasFrameNamed("__model__", instance):
        return plant.GetFrameByName("__model__", instance)
    return roots[0].body_frame()


def check_planar(
    scenario: Scenario,
    assembly: Assembly,
    plant: MultibodyPlant,
    context: Context,
    chains: Sequence[tuple[RigidBody, tuple[Joint, ...]]],
) -> None:
    """Refuse bases that are tilted and joints that would move bodies out of the plane.

    The plant is finalized; the context may hold any configuration, as the object's frame is upright in each.
    ``chains`` are base and joints of each robot.

    Raises:
        ScenarioError: Naming the base or the joint.
    """
    for robot, (base, joints) in zip(assembly.robots, chains, strict=True):
        R_WB = base.body_frame().CalcRotationMatrixInWorld(context).matrix()
        if not is_upright(R_WB[:, 2]) or R_WB[2, 2] < 0.0:
            raise refusal(scenario, robot, scoped(plant, base), "a base whose z axis points up when grasped")
        for joint in joints:
            axis, revolute = axis_in_world(joint, context), joint.type_name() == "revolute"
            if not (is_upright(axis) if revolute else abs(axis[2]) <= TILT):
                wanted = "a vertical axis" if revolute else "an axis in the floor's plane"
                remedy = f"or a value for it under fixed_joints.{robot.name}"
                allowed = f"{wanted}, not {_text(axis)} in the world; {remedy}"
                raise refusal(scenario, robot, scoped(plant, joint), allowed)


def check_masses(scenario: Scenario, assembly: Assembly, plant: MultibodyPlant, context: Context) -> None:
    """Refuse masses for which some motion takes no effort, and constraints between joints.

    Raises:
        ScenarioError: The mass matrix is singular, the object has no mass, or a file adds constraints.
    """
    refuse = partial(refusal, scenario, None)
    if plant.num_constraints() > 0:
        raise refuse("constraints in the models", "joints that are not coupled to one another")
    mass_matrix = plant.CalcMassMatrix(context)
    if not np.isfinite(mass_matrix).all():
        raise refuse("an infinite or undefined inertia", "finite masses and lengths")
    values = np.linalg.eigvalsh(mass_matrix)
    if values[0] <= 1e-12 * values[-1]:
        raise refuse(f"least inertia {values[0]:.3g}", "masses and inertias that resist every motion")
    bodies = bodies_of(plant, [assembly.object_model])
    if sum(body.get_mass(context) for body in bodies) <= 0.0:
        raise refuse(assembly.object_model, "an object with a positive mass")


def axis_in_world(joint: Joint, context: Context) -> FloatArray:
    """Unit axis of a revolute or prismatic joint in the world, shape (3,)."""
    R_WF = joint.frame_on_parent().CalcRotationMatrixInWorld(context)
    axis = joint.revolute_axis() if joint.type_name() == "revolute" else joint.translation_axis()
    return np.asarray(R_WF.multiply(axis), dtype=float)


def _text(axis: FloatArray) -> str:
    return "(" + ", ".join(f"{round(float(value), 9) + 0.0:.4g}" for value in axis) + ")"
