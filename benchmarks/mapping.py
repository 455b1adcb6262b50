"""What maps cost and how good they are: of the base plan, of shapes of every kind, of growing shapes."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from benchmarks.domains import Domain, hall_with_pillars, standard_domains, wavy_room
from benchmarks.map_rows import ablation_rows, cost_rows, map_rows
from benchmarks.rows import Row, best_seconds
from benchmarks.tasks import Task
from benchmarks.transport import base_plan
from coop_drake.answers import Plan
from coop_drake.harmonic_maps import TOLERANCE, HarmonicMap, MapStore, VelocityField
from coop_drake.simulation import build_maps

VERTICES = (10, 30, 100, 300, 1_000)
PILLARS = (0, 1, 6, 20, 50)

#: Largest residuals on such shapes of hntf2d, the authors' own implementation, with 3200 elements.
_HNTF2D = {
    "square": 2e-3,
    "u_corridor": 1e-2,
    "warehouse": 8e-3,
    "maze": 7e-2,
    "minkowski_mitre": 1e-2,
    "minkowski_round": 4e-3,
    "goal_on_ring": 8e-3,
}
_POINTS = 2_000


def mapping_tasks() -> list[Task]:
    """One task for the base plan, one for every shape, one for the ablation of the compression."""
    tasks = [Task("mapping/base", lambda rows: base_rows(), alone=True)]
    tasks += [
        _task(f"mapping/domains/{name}", domain, _HNTF2D[name]) for name, domain in standard_domains().items()
    ]
    grown = {f"vertices/{count}": wavy_room(count) for count in VERTICES}
    grown.update({f"holes/{count}": hall_with_pillars(count) for count in PILLARS})
    for what, domain in grown.items():
        tasks.append(_growth_task(f"mapping/growth/{what}", domain))
    name, maze = "mapping/ablation/skeletons", standard_domains()["maze"]
    tasks.append(Task(name, lambda rows: ablation_rows(name, maze), alone=True))
    return tasks


def _task(name: str, domain: Domain, hntf2d_residual: float) -> Task:
    return Task(name, lambda rows: map_rows(name, domain, hntf2d_residual), alone=True)


def _growth_task(name: str, domain: Domain) -> Task:
    return Task(name, lambda rows: cost_rows(name, domain), alone=True)


def base_rows() -> list[Row]:
    """Build, keep and judge all maps of the base plan, and follow their fields."""
    _, plan = base_plan()
    first, _ = _build(plan)
    alone = min(_build(plan, workers=1)[0] for _ in range(3))
    seconds = min(_build(plan)[0] for _ in range(3))
    with TemporaryDirectory() as folder:
        _build(plan, store=MapStore(Path(folder)))
        kept, maps = _build(plan, store=MapStore(Path(folder)))
        size = MapStore(Path(folder)).size() / 1e6
    accuracies = [harmonic_map.accuracy for harmonic_map in maps]
    residual = max(accuracy.residual for accuracy in accuracies)
    return [
        Row("mapping/base/maps", len(maps), "-"),
        Row("mapping/base/largest_unknowns", max(c.unknowns for c in accuracies), "-"),
        Row("mapping/base/first_seconds", first, "s"),
        Row("mapping/base/seconds", seconds, "s", "one worker", alone),
        Row("mapping/base/read_seconds", kept, "s", "solving", seconds),
        Row("mapping/base/kept_size", size, "MB"),
        Row("mapping/base/residual", residual, "-", "tolerance", TOLERANCE),
        _field_row(plan, maps),
    ]


def _field_row(plan: Plan, maps: tuple[HarmonicMap, ...]) -> Row:
    """The field of the largest map at one point, beside a sum over its sources in numpy."""
    index = int(np.argmax([harmonic_map.accuracy.unknowns for harmonic_map in maps]))
    field, point = VelocityField(maps[index]), plan.cells[index].tidied.representative_point().coords[0]
    sources = np.exp(1j * np.arange(maps[index].accuracy.unknowns))
    sums = best_seconds(lambda: [np.sum(1.0 / (sources - 0.1)) for _ in range(_POINTS)], 3)
    seconds = best_seconds(lambda: [field(point) for _ in range(_POINTS)], 3)
    peer = f"sum over {len(sources)} sources"
    return Row("mapping/base/field_at_one_point", 1e6 * seconds / _POINTS, "us", peer, 1e6 * sums / _POINTS)


def _build(
    plan: Plan, *, workers: int | None = None, store: MapStore | None = None
) -> tuple[float, tuple[HarmonicMap, ...]]:
    start = perf_counter()
    maps = build_maps(plan, workers=workers, store=store)
    return perf_counter() - start, maps
