"""The link of the chain that maps cells: solved now or read from the user's cache, and noted."""

from __future__ import annotations

import json

from coop_drake.answers import Plan
from coop_drake.cli.map_cache import map_cache
from coop_drake.cli.measures import map_measures
from coop_drake.cli.reading import Task
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.errors import FieldError
from coop_drake.fields import HarmonicMap
from coop_drake.files import write_atomically
from coop_drake.simulation import build_maps, certificate_rows

__all__ = ["map_cells", "save_certificates"]


def map_cells(task: Task, found: Plan, reporter: Reporter, *, fresh: bool) -> tuple[HarmonicMap, ...]:
    """Map every cell of a plan and note what it took and how good the maps are.

    Args:
        task: The scenario.
        found: The plan.
        reporter: Takes note.
        fresh: Whether maps solved before are left aside.

    Raises:
        FieldError: A cell cannot be mapped; the message names it, and the setting that it is measured by.
    """
    store, tolerance = None if fresh else map_cache(), task.scenario.maps.tolerance
    with reporter.stage("mapping") as progress, reporter.stopwatch("mapping"):
        try:
            maps = build_maps(found, tolerance=tolerance, store=store, progress=progress)
        except FieldError as error:
            raise FieldError(f"{error} ({task.scenario.path}: maps.tolerance is {tolerance:g})") from error
    reporter.facts.update(map_measures(maps), maps_read=0 if store is None else store.found)
    return maps


def save_certificates(task: Task, maps: tuple[HarmonicMap, ...], folder: ResultFolder) -> None:
    """Write what every map is worth."""
    document = {"tolerance": task.scenario.maps.tolerance, "maps": certificate_rows(maps)}
    write_atomically(folder.maps, json.dumps(document, indent=1).encode() + b"\n")
