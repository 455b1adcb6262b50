"""Loads a scenario file, and writes one."""

import dataclasses
from pathlib import Path

from pydrake.common.yaml import yaml_dump_typed

from coop_drake.errors import ScenarioError
from coop_drake.scenario.document import DocumentError
from coop_drake.scenario.model import Scenario
from coop_drake.scenario.schema import departures, draft, read, thaw
from coop_drake.scenario.validation import validate


def load_scenario(path: Path | str) -> Scenario:
    """Read and check a scenario file.

    Everything that can be judged without bodies is checked here; what needs them (collisions, joint
    limits) is checked by :func:`coop_drake.plant.planning_problem`.

    Args:
        path: The file, ``NAME.scenario.yaml`` by custom.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(str(path), "the file", str(error), "a readable scenario file") from error
    try:
        for key, value, allowed in departures(Scenario, text):
            raise ScenarioError(str(path), key, value, allowed)
    except DocumentError as error:
        raise ScenarioError(str(path), error.place, error.problem, error.allowed) from error
    try:
        scenario = dataclasses.replace(read(Scenario, text), path=path)
    except (RuntimeError, TypeError, ValueError) as error:
        raise ScenarioError(str(path), "the file", str(error), "values that fit the schema") from error
    validate(scenario)
    return scenario


def dump_scenario(scenario: Scenario) -> str:
    """Write a scenario as YAML text that :func:`load_scenario` reads back to the same values."""
    return str(yaml_dump_typed(thaw(scenario), schema=draft(Scenario)))
