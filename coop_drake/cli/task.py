"""What most commands begin with: a scenario, its planning problem, and the maps of a plan for it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coop_drake.cli.summary import map_facts
from coop_drake.errors import FieldError
from coop_drake.files import cache_folder

if TYPE_CHECKING:
    from pathlib import Path

    from coop_drake.answers import Plan, PlanningProblem
    from coop_drake.cli.reporter import Reporter
    from coop_drake.cli.results import ResultFolder
    from coop_drake.harmonic_maps import HarmonicMap, MapStore
    from coop_drake.scenario import Scenario


@dataclass(frozen=True)
class Task:
    """A scenario without mistakes.

    Attributes:
        scenario: As in the file, with the chosen gain set selected.
        problem: Floor, bodies, start and goal, as the planner needs them.
    """

    scenario: Scenario
    problem: PlanningProblem

    @property
    def name(self) -> str:
        """The scenario's name."""
        return self.scenario.name


def read_task(path: Path, gains: str | None = None, reporter: Reporter | None = None) -> Task:
    """Read a scenario and its models.

    Args:
        path: The file of the scenario.
        gains: As in `coop_drake.scenario.with_gains`.
        reporter: Shows what the reader of the floor plan left out or assumed, and joints whose kind and
            limits differ; None for nobody.

    Raises:
        ScenarioError: The file, a model or the gain set is wrong.
        FloorPlanError: The floor plan cannot be read.
    """
    from coop_drake.plant import joint_notes, planning_problem
    from coop_drake.scenario import load_scenario
    from coop_drake.scenario.load import with_gains

    scenario = with_gains(load_scenario(path), gains)
    if reporter is not None:
        reporter.note(scenario.workspace.notes)
    problem = planning_problem(scenario)
    if reporter is not None:
        reporter.note(joint_notes(scenario, problem))
    return Task(scenario, problem)


def map_cache() -> MapStore:
    """The maps in the folder that the system has for a user's caches, or that ``COOP_DRAKE_CACHE`` names."""
    from coop_drake.harmonic_maps import MapStore

    return MapStore(cache_folder("maps"))


def map_cells(task: Task, plan: Plan, reporter: Reporter, *, fresh: bool = False) -> tuple[HarmonicMap, ...]:
    """Map every cell of a plan, and note how long it took and how accurate the maps are.

    A team that follows a motion needs no maps, and none are made.

    ``fresh`` maps are all solved; others are read from the cache where it has them.

    Raises:
        FieldError: A cell cannot be mapped; the message names it, and the tolerance that was asked for.
    """
    from coop_drake.simulation import build_maps

    if plan.motion is not None:
        return ()
    store, tolerance = None if fresh else map_cache(), task.scenario.maps.tolerance
    with reporter.stage("mapping", "mapping") as progress:
        try:
            maps = build_maps(plan, tolerance=tolerance, store=store, progress=progress)
        except FieldError as error:
            raise FieldError(f"{error} ({task.scenario.path}: maps.tolerance is {tolerance:g})") from error
    reporter.facts.update(map_facts(maps), maps_read=0 if store is None else store.found)
    return maps


def write_accuracies(task: Task, maps: tuple[HarmonicMap, ...], folder: ResultFolder) -> None:
    """Write the estimated accuracy of every map as ``maps.json``, if there are maps."""
    if not maps:
        return
    from coop_drake.files import write_atomically
    from coop_drake.simulation import accuracy_rows

    document = {"tolerance": task.scenario.maps.tolerance, "maps": accuracy_rows(maps)}
    write_atomically(folder.path / "maps.json", json.dumps(document, indent=1).encode() + b"\n")
