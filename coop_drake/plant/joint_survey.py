"""Tells which joints of a model move in the plane, and which a scenario must fix."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint
from pydrake.systems.framework import Context

from coop_drake.errors import ScenarioError
from coop_drake.plant.chain import is_circle, limits_of
from coop_drake.plant.parsing import joints_of
from coop_drake.plant.planarity import TILT, axis_in_world, is_upright


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
