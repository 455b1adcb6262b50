"""Digests of a scenario and its models: which scenario a log belongs to, and what processes must agree on."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ForceElementIndex, Joint
from pydrake.systems.framework import DiagramBuilder

from coop_drake.answers.digest import content_digest, tree_document
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.parsing import joints_of, read_once
from coop_drake.plant.team import build_team_plant
from coop_drake.scenario import Scenario
from coop_drake.typed_data import to_plain

_NOT_IN_A_RUN = ("planner", "gains", "maps", "visualization")
"""Sections that change a run only through its plan, or not at all."""

_DECIMALS = 12
"""Decimals that a digest sees of a number in SI units: last bits differ between machines."""

_OF_FORCES = ("stiffness", "damping", "free_length", "nominal_position", "p_AP", "p_BQ")
"""Constants of springs that are no parameters of the plant's context."""


def scenario_digest(scenario: Scenario, models: str | None = None) -> str:
    """Return the SHA-256 over all that a run takes from its scenario besides the plan, in hexadecimal.

    Args:
        scenario: The scenario.
        models: ``models_digest`` of a scenario with the same models; None to read them.
    """
    content = {key: value for key, value in to_plain(scenario, Scenario).items() if key not in _NOT_IN_A_RUN}
    return content_digest({"scenario": content, "models": models or models_digest(scenario)})


@read_once
def models_digest(scenario: Scenario) -> str:
    """Return the SHA-256 over all numbers and names that Drake has read from a scenario's models.

    It sees what Drake makes of the files, not the files: whatever a model includes, by whatever name, counts
    as soon as it changes a mass, a joint, a limit, a spring or a shape that can collide. It is the same
    wherever the files are. Shapes that are only shown are not in it.

    Raises:
        ScenarioError: The models make no team.
    """
    team = build_team_plant(scenario, DiagramBuilder())
    plant = team.plant
    parameters = (
        plant.CreateDefaultContext().get_parameters()
    )  # Masses, inertias, frames, axes, damping, rotors
    groups = range(parameters.num_numeric_parameter_groups())
    motors = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return content_digest(
        {
            "parameters": [_numbers(parameters.get_numeric_parameter(i).CopyToVector()) for i in groups],
            "joints": [_joint(joint) for joint in joints_of(plant)],
            "efforts": [[motor.joint().name(), *_numbers(motor.effort_limit())] for motor in motors],
            "forces": [_force(plant, index) for index in range(plant.num_force_elements())],
            "tree": tree_document(read_component_tree(team)),
        }
    )


def _joint(joint: Joint) -> list[Any]:
    bodies = [
        f"{int(body.model_instance())} {body.name()}" for body in (joint.parent_body(), joint.child_body())
    ]
    limits = [
        getattr(joint, f"{kind}_{end}_limits")()
        for kind in ("position", "velocity", "acceleration")
        for end in ("lower", "upper")
    ]
    return [joint.type_name(), joint.name(), *bodies, *map(_numbers, limits)]


def _force(plant: MultibodyPlant, index: int) -> list[Any]:
    force = plant.get_force_element(ForceElementIndex(index))
    constants = [_numbers(getattr(force, name)()) for name in _OF_FORCES if hasattr(force, name)]
    return [type(force).__name__, force.joint().name() if hasattr(force, "joint") else "", *constants]


def _numbers(values: Any) -> list[str]:
    """Return numbers as texts, which JSON has for infinity, too."""
    return [repr(round(float(value), _DECIMALS) + 0.0) for value in np.atleast_1d(values)]
