"""Builds the harmonic maps of a plan, in parallel on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from shapely import Point
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from coop_drake.answers.plan import Plan
from coop_drake.errors import FieldError
from coop_drake.harmonic_maps import TOLERANCE, HarmonicMap, MapStore

_MOST_WORKERS = 8  # More of them wait for one another: between kernels they share one interpreter.


def build_maps(
    plan: Plan,
    *,
    tolerance: float = TOLERANCE,
    store: MapStore | None = None,
    workers: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> tuple[HarmonicMap, ...]:
    """Map every cell of a plan to the disk; none where the team follows a motion, which needs no fields.

    Every map is solved on one thread, whatever the number of workers: the result is the same to the last bit.

    Args:
        plan: The plan.
        tolerance: Largest estimated error accepted; a scenario's is ``maps.tolerance`` [-].
        store: Where maps are looked up first and kept; by default all are solved.
        workers: How many maps are solved at the same time; by default one a core, eight at most.
        progress: Called with the stage and the fraction done, if given.

    Raises:
        FieldError: A map cannot be built or its estimated error is too large; the message names the cell.
    """
    if plan.motion is not None:
        return ()

    def solve(index: int) -> HarmonicMap:
        cell, target = plan.governed(index), Point(plan.transitions[index].target)
        if store is not None:
            return store.map_of(cell, target, tolerance=tolerance)
        return HarmonicMap(cell, target, tolerance=tolerance)

    maps: list[HarmonicMap] = []
    count = len(plan.cells)
    pool = ThreadPoolExecutor(workers or min(_MOST_WORKERS, os.cpu_count() or 1))
    with threadpool_limits(1, user_api="blas"):
        try:
            for index, future in enumerate([pool.submit(solve, k) for k in range(count)]):
                try:
                    maps.append(future.result())
                except FieldError as error:
                    raise FieldError(f"cell {index} of {count}: {error}") from error
                if progress is not None:
                    progress("mapping", (index + 1) / count)
        finally:
            pool.shutdown(cancel_futures=True)
    if store is not None and store.found < count:
        store.trim()
    return tuple(maps)


def accuracy_rows(maps: Sequence[HarmonicMap]) -> list[dict[str, Any]]:
    """Return the accuracy of maps as plain values by the names of `MapAccuracy`, cells from 0."""
    rows = []
    for cell, harmonic_map in enumerate(maps):
        vertices = len(harmonic_map.solution.arrays.edges)
        rows.append({"cell": cell, "vertices": vertices, **harmonic_map.accuracy.plain()})
    return rows
