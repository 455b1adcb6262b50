"""Loads scenario files with the floor plans and gain sets that they name, and writes them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from coop_drake.errors import Finding, ScenarioError
from coop_drake.geometry.polygons import corners_of
from coop_drake.laws.gains import GainSet
from coop_drake.scenario.document import read_file, write
from coop_drake.scenario.model import Gains, Scenario, Workspace
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
    from coop_drake.scenario.checks import validate

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
        raise ScenarioError(str(path), "the file", Finding("a folder"), files)
    if not file.exists():
        known = ", ".join(shipped_scenarios())
        raise ScenarioError(
            str(path), "the file", Finding("no such file"), f"a readable file, or a shipped scenario: {known}"
        )
    return with_floor(dataclasses.replace(read_file(Scenario, file), path=file))


def dump_scenario(scenario: Scenario) -> str:
    """Write a scenario as YAML text that :func:`load_scenario` reads back to the same values."""
    return write(to_plain(scenario, Scenario))


def with_gains(scenario: Scenario, choice: str | None) -> Scenario:
    """Return the scenario of a team that rests in every cell with a gain set.

    Args:
        scenario: The scenario.
        choice: Name of one of its gain sets, or a file with a ``gains`` section; None for what
            the scenario selects.

    Raises:
        ScenarioError: There is no such set and no such file, or the file is wrong.
    """
    if choice is None:
        return scenario
    if choice in scenario.gains.sets:
        return dataclasses.replace(scenario, gains=dataclasses.replace(scenario.gains, selected=choice))
    if not Path(choice).is_file():
        allowed = f"one of {', '.join(sorted(scenario.gains.sets))}, or a file with a gain set"
        raise ScenarioError(str(scenario.path), "--gains", choice, allowed)
    read: Gains = read_file(Gains, Path(choice))
    if read.selected not in read.sets:
        raise ScenarioError(choice, "selected", read.selected, "one of " + ", ".join(sorted(read.sets)))
    return dataclasses.replace(
        scenario, gains=dataclasses.replace(read, sets={**scenario.gains.sets, **read.sets})
    )


def dump_gains(name: str, gain_set: GainSet) -> str:
    """Write a gain set as YAML text that ``--gains`` reads, and that fits a scenario under ``gains``."""
    return write({"selected": name, "sets": {name: to_plain(gain_set, GainSet)}})


def with_floor(scenario: Scenario) -> Scenario:
    """Replace the file of a floor plan by the rings of its floor; return a scenario with rings unchanged.

    Raises:
        ScenarioError: The workspace has neither rings nor a file, or both, or the file does not exist.
        FloorPlanError: The file cannot be read.
    """
    file, workspace = str(scenario.path), scenario.workspace
    if workspace.file is None:
        _check_rings_alone(file, workspace)
        return scenario
    for key in ("outer", "holes"):
        if getattr(workspace, key):
            raise ScenarioError(file, f"workspace.{key}", "rings", "nothing beside workspace.file")
    # Imported here because most scenarios have rings and need no readers of drawings.
    from coop_drake.floor_plans.plan import read_floor_plan
    from coop_drake.floor_plans.rooms import Inside
    from coop_drake.floor_plans.settings import FloorPlanSettings
    from coop_drake.scenario.directives import package_map, resolve

    found = resolve(workspace.file, scenario.path, package_map(scenario.path), file, "workspace.file")
    start = scenario.start.object
    path = Path(found.removeprefix("file://"))
    names = [field.name for field in dataclasses.fields(FloorPlanSettings)]
    settings = FloorPlanSettings(**{name: getattr(workspace, name) for name in names})
    plan = read_floor_plan(path, settings, Inside(start.x, start.y, "start.object"))
    outer, *holes = (tuple((x, y) for x, y in corners.tolist()) for corners in corners_of(plan.polygon))
    notes = tuple(f"{path.name}: {note}" for note in plan.notes)
    return dataclasses.replace(scenario, workspace=Workspace(outer, tuple(holes), notes=notes))


def _check_rings_alone(file: str, workspace: Workspace) -> None:
    if not workspace.outer:
        raise ScenarioError(file, "workspace.outer", [], "a ring of three or more corners, or workspace.file")
    usual = Workspace()
    for field in dataclasses.fields(Workspace):
        value = getattr(workspace, field.name)
        if field.name not in ("outer", "holes", "notes") and value != getattr(usual, field.name):
            raise ScenarioError(file, f"workspace.{field.name}", value, "nothing without workspace.file")
