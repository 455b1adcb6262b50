"""Loads scenario files and writes them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from coop_drake.errors import ScenarioError
from coop_drake.scenario.document import write
from coop_drake.scenario.floor import with_floor
from coop_drake.scenario.model import Scenario
from coop_drake.scenario.reading import read_file
from coop_drake.shipped import scenario_file, shipped_scenarios
from coop_drake.typed_data import to_plain


def load_scenario(path: Path | str) -> Scenario:
    """Read and check a scenario file.

    Collisions and joint limits need the models of the bodies and are checked later, by
    :func:`coop_drake.plant.planning_problem`; all else is checked here.

    Args:
        path: The file, usually ``NAME.scenario.yaml``; a folder with exactly one such file; or the name of a
            shipped scenario, such as ``base``.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
        FloorPlanError: The workspace names a floor plan that cannot be read.
    """
    from coop_drake.scenario.validation import validate

    scenario = read_scenario(path)
    validate(scenario)
    return scenario


def read_scenario(path: Path | str) -> Scenario:
    """Read a scenario file as :func:`load_scenario` does, without the checks that relate several values.

    Drake is not imported unless the workspace is a floor plan in another file.

    Raises:
        ScenarioError: The file cannot be read, or a single value in it is not allowed.
        FloorPlanError: The workspace names a floor plan that cannot be read.
    """
    file = scenario_file(path)
    if file.is_dir():
        files = "a file, or a folder with just one *.scenario.yaml"
        raise ScenarioError(str(path), "the file", "a folder", files)
    if not file.exists():
        known = ", ".join(shipped_scenarios())
        raise ScenarioError(
            str(path), "the file", "no such file", f"a readable file, or a shipped scenario: {known}"
        )
    return with_floor(dataclasses.replace(read_file(Scenario, file), path=file))


def dump_scenario(scenario: Scenario) -> str:
    """Write a scenario as YAML text that :func:`load_scenario` reads back to the same values."""
    return write(to_plain(scenario, Scenario))
