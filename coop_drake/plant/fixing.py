"""Fixes joints that the scenario names: wheels, fingers and joints that would leave the plane."""

from collections.abc import Mapping
from fnmatch import fnmatchcase
from math import pi

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint, WeldJoint

from coop_drake.errors import ScenarioError
from coop_drake.plant.chain import MOVABLE, limits_of
from coop_drake.plant.parsing import joints_of
from coop_drake.scenario import Assembly, Scenario

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
