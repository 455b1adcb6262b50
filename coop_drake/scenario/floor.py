"""Reads the floor plan that a scenario names: the workspace is the room in which the object starts."""

import dataclasses
from pathlib import Path

from coop_drake.errors import ScenarioError
from coop_drake.geometry.parts import corners_of
from coop_drake.scenario.model import Scenario, Workspace
from coop_drake.scenario.packages import package_map, resolve


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
