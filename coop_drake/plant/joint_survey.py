"""A robot from elsewhere: its joints, and where its gripper is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import atan2, isfinite
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import yaml
from defusedxml.ElementTree import fromstring
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Joint
from pydrake.systems.framework import Context

from coop_drake.errors import ScenarioError
from coop_drake.plant.chain import TILT, axis_in_world, is_circle, is_upright, limits_of
from coop_drake.plant.parsing import joints_of


@dataclass(frozen=True)
class SurveyedJoint:
    """One joint that can move.

    Attributes:
        name: Its name in the model.
        kind: Drake's name for its type.
        axis: In the base's frame, as text.
        limits: As text [rad or m].
        verdict: ``planar``, ``fix it`` for what leaves the plane, or ``fixed`` where a value was given.
        rest: The value that was given, or else the one between the limits that is nearest to zero [rad or m].
    """

    name: str
    kind: str
    axis: str
    limits: str
    verdict: str
    rest: float = 0.0


def survey_joints(path: Path, values: Mapping[str, float] | None = None) -> tuple[SurveyedJoint, ...]:
    """Judge every movable joint of a model, with meshes that Drake reads, whose base stands upright.

    ``values`` say where some joints are fixed; all others stand at zero [rad or m].

    Raises:
        ScenarioError: Drake cannot read the model, or a value is for no joint of it.
    """
    plant, context = plant_at(path, values or {})
    return tuple(_judged(joint, context, joint.name() in (values or {})) for joint in _movable(plant))


def plant_at(path: Path, values: Mapping[str, float]) -> tuple[MultibodyPlant, Context]:
    """Parse a model that stands alone, and place some of its joints, by name [rad or m].

    Raises:
        ScenarioError: Drake cannot read the model, or a value is for no joint of it.
    """
    plant = MultibodyPlant(0.0)
    try:
        Parser(plant).AddModels(str(path))
        plant.Finalize()
    except RuntimeError as error:
        message = " ".join(str(error).split())
        raise ScenarioError(str(path), "the model", path.name, f"what Drake can read ({message})") from error
    context = plant.CreateDefaultContext()
    known = {joint.name(): joint for joint in _movable(plant)}
    for name, value in values.items():
        if name not in known or known[name].num_positions() != 1:
            movable = ", ".join(known) or "none"
            raise ScenarioError(str(path), "--fix", name, f"a joint that can be fixed, one of {movable}")
        positions = plant.GetPositions(context)
        positions[known[name].position_start()] = value
        plant.SetPositions(context, positions)
    return plant, context


def _movable(plant: MultibodyPlant) -> list[Joint]:
    return [joint for joint in joints_of(plant) if joint.type_name() not in ("weld", "quaternion_floating")]


def _judged(joint: Joint, context: Context, fixed: bool) -> SurveyedJoint:
    kind = str(joint.type_name())
    if kind not in ("revolute", "prismatic"):
        return SurveyedJoint(joint.name(), kind, "", "", "fixed" if fixed else "fix it")
    axis = axis_in_world(joint, context)
    planar = is_upright(axis) if kind == "revolute" else abs(float(axis[2])) <= TILT
    lower, upper = limits_of(joint)
    circle = is_circle(joint)
    endless = not (circle or (isfinite(lower) and isfinite(upper)))
    return SurveyedJoint(
        joint.name(),
        kind,
        "(" + ", ".join(f"{value + 0.0:.3g}" for value in np.round(axis, 6)) + ")",
        "no limits, a circle" if circle else f"{lower:.4g} to {upper:.4g}",
        "fixed" if fixed else "planar" if planar and not endless else "fix it",
        float(joint.GetOnePosition(context)) if fixed else min(max(0.0, lower), upper),
    )


# Adds a gripper frame to a model from elsewhere, and words the lines of a scenario that use the model.


GRIPPER = "gripper"
"""Name of the frame, as in the shipped models."""

_SMALLEST_REACH = 1e-3
"""A link nearer to the base's axis than this has no direction back to it [m]."""


def has_gripper(model: Path) -> bool:
    """Whether a model has a frame or link of that name."""
    return plant_at(model, {})[0].HasFrameNamed(GRIPPER)


def with_gripper(model: Path, link: str, values: Mapping[str, float]) -> bytes:
    """Add the frame ``gripper`` at the origin of a link, upright, with x pointing back to the base.

    Args:
        model: A URDF or SDF file that Drake reads, without such a frame.
        link: Name of the link whose origin is held at the object.
        values: Where joints stand when the frame is upright [rad or m]; all others stand at zero.

    Returns:
        The content of the file with the frame.

    Raises:
        ScenarioError: There is no such link, or it lies above the base.
    """
    plant, context = plant_at(model, values)
    bodies = [plant.get_body(BodyIndex(number)) for number in range(1, plant.num_bodies())]
    if link not in (names := [body.name() for body in bodies]):
        raise ScenarioError(str(model), "--gripper", link, f"a link of the model, one of {', '.join(names)}")
    X_WL = bodies[names.index(link)].EvalPoseInWorld(context)
    base = next(body for body in bodies if body.is_floating_base_body())
    back = (base.EvalPoseInWorld(context).translation() - X_WL.translation())[:2]
    if np.hypot(*back) < _SMALLEST_REACH:
        raise ScenarioError(str(model), "--gripper", link, "a link that is not above the base's origin")
    upright = RotationMatrix.MakeZRotation(atan2(back[1], back[0]))
    X_LG = X_WL.inverse() @ RigidTransform(upright, X_WL.translation())
    root = fromstring(model.read_bytes())
    (_add_to_urdf if root.tag == "robot" else _add_to_sdf)(root, link, X_LG)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'.encode()


def scenario_lines(model: Path, joints: Sequence[SurveyedJoint], gripper: str) -> str:
    """The lines with which a scenario uses a model, as YAML: directives, start, fixed joints.

    Args:
        model: Path of the model, relative to the scenario.
        joints: All its movable joints.
        gripper: The frame that is welded to the object.
    """
    name = "robot_0"
    lines: dict[str, object] = {
        "directives": [
            {"add_model": {"name": name, "file": model.as_posix()}},
            {"add_weld": {"parent": "object::grasp_0", "child": f"{name}::{gripper}"}},
        ],
        "start": {"joints": {name: [joint.rest for joint in joints if joint.verdict == "planar"]}},
    }
    if fixed := {joint.name: joint.rest for joint in joints if joint.verdict != "planar"}:
        lines["fixed_joints"] = {name: fixed}
    text: str = yaml.safe_dump(lines, default_flow_style=None, sort_keys=False, width=1000)
    return text


def _add_to_urdf(root: ElementTree.Element, link: str, X_LG: RigidTransform) -> None:
    ElementTree.SubElement(root, "link", {"name": GRIPPER})
    joint = ElementTree.SubElement(root, "joint", {"name": f"{GRIPPER}_mount", "type": "fixed"})
    ElementTree.SubElement(joint, "parent", {"link": link})
    ElementTree.SubElement(joint, "child", {"link": GRIPPER})
    ElementTree.SubElement(joint, "origin", {"xyz": _words(X_LG.translation()), "rpy": _angles(X_LG)})


def _add_to_sdf(root: ElementTree.Element, link: str, X_LG: RigidTransform) -> None:
    model = next(root.iter("model"))
    frame = ElementTree.SubElement(model, "frame", {"name": GRIPPER, "attached_to": link})
    ElementTree.SubElement(frame, "pose").text = f"{_words(X_LG.translation())} {_angles(X_LG)}"


def _angles(X_LG: RigidTransform) -> str:
    return _words(RollPitchYaw(X_LG.rotation()).vector())


def _words(numbers: Sequence[float]) -> str:
    return " ".join(f"{number + 0.0:.16g}" for number in numbers)
