"""The command maps, and the maps of a plan: read from the user's cache, or solved and kept there."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import Machine
from coop_drake.cli.reporter import Reporter, reporting
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import map_facts
from coop_drake.cli.task import Task
from coop_drake.errors import FieldError
from coop_drake.files import cache_folder

if TYPE_CHECKING:
    from coop_drake.answers import Plan
    from coop_drake.fields import HarmonicMap, MapStore


def maps_command(
    clear: Annotated[bool, typer.Option("--clear", help="Delete all of them.")] = False,
    machine: Machine = False,
) -> None:
    """Show where solved maps are kept for later runs, or delete them."""
    with reporting(machine=machine) as reporter:
        store = map_cache()
        count, size = len(store.files()), store.size() / 1e6
        if clear:
            store.clear()
        reporter.facts.update(folder=str(store.folder), maps=count, size_mb=round(size, 3), cleared=clear)
        verb = "Deleted" if clear else "There are"
        reporter.say(f"{verb} {count} maps of {size:.1f} MB in {escape(str(store.folder))}")


def map_cache() -> MapStore:
    """The maps in the folder that the system has for a user's caches, or that ``COOP_DRAKE_CACHE`` names."""
    from coop_drake.fields import MapStore

    return MapStore(cache_folder("maps"))


def map_cells(task: Task, plan: Plan, reporter: Reporter, *, fresh: bool = False) -> tuple[HarmonicMap, ...]:
    """Map every cell of a plan, and note how long it took and how accurate the maps are.

    ``fresh`` maps are all solved; others are read from the cache where it has them.

    Raises:
        FieldError: A cell cannot be mapped; the message names it, and the tolerance that was asked for.
    """
    from coop_drake.simulation import build_maps

    store, tolerance = None if fresh else map_cache(), task.scenario.maps.tolerance
    with reporter.stage("mapping", "mapping") as progress:
        try:
            maps = build_maps(plan, tolerance=tolerance, store=store, progress=progress)
        except FieldError as error:
            raise FieldError(f"{error} ({task.scenario.path}: maps.tolerance is {tolerance:g})") from error
    reporter.facts.update(map_facts(maps), maps_read=0 if store is None else store.found)
    return maps


def write_accuracies(task: Task, maps: tuple[HarmonicMap, ...], folder: ResultFolder) -> None:
    """Write the estimated accuracy of every map as ``maps.json``."""
    from coop_drake.files import write_atomically
    from coop_drake.simulation import accuracy_rows

    document = {"tolerance": task.scenario.maps.tolerance, "maps": accuracy_rows(maps)}
    write_atomically(folder.path / "maps.json", json.dumps(document, indent=1).encode() + b"\n")
