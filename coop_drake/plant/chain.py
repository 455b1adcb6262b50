"""Chains of bodies and joints of a plant: their parts, that they are planar, which joints are fixed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial
from math import inf, isfinite, pi

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, Joint, RigidBody, WeldJoint
from pydrake.systems.framework import Context

from coop_drake.errors import ScenarioError
from coop_drake.plant.parsing import bodies_of, joints_of, refusal
from coop_drake.scenario import Assembly, RobotAssembly, Scenario
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import PlanarPose

MOVABLE = ("revolute", "prismatic")

_ENDLESS = 1e3
"""Limits of this size or more count as none; files often write 1e16 for a joint without limits [rad or m]."""


def scoped(plant: MultibodyPlant, element: RigidBody | Joint) -> str:
    """Name of a body or joint with its model: ``robot_0::link_1``."""
    return f"{plant.GetModelInstanceName(element.model_instance())}::{element.name()}"


def find_base(
    scenario: Scenario, robot: RobotAssembly, plant: MultibodyPlant
) -> tuple[RigidBody, tuple[Joint, ...]]:
    """Find a robot's base body and its joints, and refuse models that are no holonomic planar manipulators.

    Args:
        scenario: For messages.
        robot: The robot.
        plant: A plant that holds the robot's models, finalized or not.

    Returns:
        The base body, and the movable joints in the order of q_k: from the base outwards, every joint before
        the joints that it carries.

    Raises:
        ScenarioError: A joint to the world, a joint that is neither fixed nor revolute nor prismatic, a joint
            without limits where limits are needed, or bodies that do not hang together.
    """
    refuse = partial(refusal, scenario, robot)
    bodies = bodies_of(plant, robot.models)
    members = {int(body.index()) for body in bodies}
    inner: list[Joint] = []
    for joint in joints_of(plant):
        ends = {int(joint.parent_body().index()), int(joint.child_body().index())}
        if ends & members and int(plant.world_body().index()) in ends:
            allowed = "a robot that no joint ties to the world; its base moves freely"
            raise refuse(scoped(plant, joint), allowed)
        if ends <= members:
            _check_kind(refuse, robot.name, plant, joint)
            inner.append(joint)
    children: set[int] = set()
    for joint in inner:
        child = joint.child_body()
        if int(child.index()) in children:
            allowed = f"exactly one joint that leads to {scoped(plant, child)}; no closed loop"
            raise refuse(scoped(plant, joint), allowed)
        children.add(int(child.index()))
    roots = [body for body in bodies if int(body.index()) not in children]
    if len(roots) != 1:
        names = ", ".join(scoped(plant, body) for body in roots) or "none"
        raise refuse(names, "one body that no joint leads to: the base")
    return roots[0], _outwards(roots[0], inner)


def limits_of(joint: Joint) -> tuple[float, float]:
    """Limits of a joint [rad or m], infinite where its model has none, as ``continuous`` joints of a URDF."""
    lower, upper = float(joint.position_lower_limits()[0]), float(joint.position_upper_limits()[0])
    return (lower if lower > -_ENDLESS else -inf, upper if upper < _ENDLESS else inf)


def is_circle(joint: Joint) -> bool:
    """Whether a joint is a circle: revolute, without limits."""
    return bool(joint.type_name() == "revolute" and limits_of(joint) == (-inf, inf))


def _check_kind(
    refuse: Callable[[str, str], ScenarioError], robot: str, plant: MultibodyPlant, joint: Joint
) -> None:
    name, kind, fixed = scoped(plant, joint), joint.type_name(), f"for it under fixed_joints.{robot}"
    if kind == "weld":
        return
    if kind not in MOVABLE:
        raise refuse(name, f"fixed, revolute or prismatic joints, not {kind}; or 0 {fixed}")
    lower, upper = limits_of(joint)
    if isfinite(lower) != isfinite(upper):
        one = f"upper limit {upper:g}" if isfinite(upper) else f"lower limit {lower:g}"
        raise refuse(
            name, f"two limits, or none for a revolute joint, not the {one} alone; or a value {fixed}"
        )
    if not isfinite(lower) and kind == "prismatic":
        raise refuse(name, f"prismatic joints with two finite limits; or a value {fixed}")
    if lower >= upper:
        raise refuse(name, f"a lower limit below the upper one, not {lower} and {upper}")


def _outwards(base: RigidBody, joints: list[Joint]) -> tuple[Joint, ...]:
    """The movable joints, depth first from the base; siblings in the order of the file."""
    ordered: list[Joint] = []
    stack = [int(base.index())]
    while stack:
        body = stack.pop()
        leading = [joint for joint in joints if int(joint.parent_body().index()) == body]
        stack.extend(int(joint.child_body().index()) for joint in reversed(leading))
        ordered.extend(joint for joint in joints if int(joint.child_body().index()) == body)
    return tuple(joint for joint in ordered if joint.type_name() in MOVABLE)


# Planarity checks: bases stand upright, revolute axes are vertical and prismatic axes are horizontal.


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


# Fixes joints that the scenario names: wheels, fingers and joints that would leave the plane.


_ROUNDING = 1e-6
"""Rounding of values and limits in files, by which a value may exceed a limit or miss a right angle [rad or
m]."""


def fix_joints(scenario: Scenario, assembly: Assembly, plant: MultibodyPlant) -> None:
    """Replace every joint that the scenario fixes by a weld.

    A name is that of a joint, or a pattern with ``*`` and ``?``. A joint's own name takes precedence over
    patterns; the value null excludes the joint from them. The plant is not finalized; robots that it does not
    hold are skipped.

    Raises:
        ScenarioError: A name matches no joint, or two patterns match the same one, or a value is not
            possible.
    """
    models = {plant.GetModelInstanceName(joint.model_instance()) for joint in joints_of(plant)}
    for robot in assembly.robots:
        values = scenario.fixed_joints.get(robot.name, {})
        if not values or models.isdisjoint(robot.models):
            continue
        joints = [joint for joint in joints_of(plant) if _model(plant, joint) in robot.models]
        movable = {joint.name(): joint for joint in joints if joint.type_name() != "weld"}
        key = f"fixed_joints.{robot.name}"
        for name, value in _meant(scenario, key, values, list(movable)).items():
            _fix(scenario, f"{key}.{name}", plant, movable[name], value)


def _model(plant: MultibodyPlant, joint: Joint) -> str:
    return str(plant.GetModelInstanceName(joint.model_instance()))


def _meant(
    scenario: Scenario, key: str, values: Mapping[str, float | None], joints: list[str]
) -> dict[str, float]:
    """The values by the names of the joints, in the joints' order."""
    known = ", ".join(joints) or "none"
    chosen: dict[str, str] = {name: name for name in values if name in joints}
    for pattern in (name for name in values if name not in joints):
        matching = [name for name in joints if fnmatchcase(name, pattern)]
        if not matching:
            allowed = f"a joint that can move, or a pattern of their names: {known}"
            raise ScenarioError(str(scenario.path), f"{key}.{pattern}", pattern, allowed)
        for name in matching:
            if chosen.setdefault(name, pattern) not in (name, pattern):
                allowed = f"one pattern for {name}; {chosen[name]} means it too"
                raise ScenarioError(str(scenario.path), f"{key}.{pattern}", pattern, allowed)
    meant = {name: values[chosen[name]] for name in joints if name in chosen}
    return {name: value for name, value in meant.items() if value is not None}


def _fix(scenario: Scenario, key: str, plant: MultibodyPlant, joint: Joint, value: float) -> None:
    file = str(scenario.path)
    if joint.type_name() in MOVABLE:
        lower, upper = limits_of(joint)
        if not lower - _ROUNDING <= value <= upper + _ROUNDING:
            allowed = f"a value between the joint's limits {lower:g} and {upper:g}"
            raise ScenarioError(file, key, value, allowed)
    elif value != 0.0:
        allowed = f"0, the only place where a {joint.type_name()} joint can be fixed"
        raise ScenarioError(file, key, value, allowed)
    for index in list(plant.GetJointActuatorIndices()):
        actuator = plant.get_joint_actuator(index)
        if int(actuator.joint().index()) == int(joint.index()):
            plant.RemoveJointActuator(actuator)
    name = str(joint.name())
    parent, child, X_FM = joint.frame_on_parent(), joint.frame_on_child(), _pose_at(joint, value)
    try:
        plant.RemoveJoint(joint)
    except RuntimeError as error:
        allowed = f"a joint in a model without springs, mimics and other constraints ({error})"
        raise ScenarioError(file, key, value, allowed) from error
    plant.AddJoint(WeldJoint(name, parent, child, X_FM))


def _pose_at(joint: Joint, value: float) -> RigidTransform:
    """Pose of the joint's child frame in its parent frame at a value of the joint."""
    if joint.type_name() == "revolute":
        quarters = round(value / (0.5 * pi))
        if abs(value - quarters * 0.5 * pi) <= _ROUNDING:  # 1.570796 in a file means a right angle.
            value = quarters * 0.5 * pi
        return RigidTransform(AngleAxis(value, joint.revolute_axis()), np.zeros(3))
    if joint.type_name() == "prismatic":
        return RigidTransform(value * np.asarray(joint.translation_axis(), dtype=float))
    return RigidTransform()
