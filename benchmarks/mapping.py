"""What the maps of the base plan cost and how good they are."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from benchmarks.rows import Row
from benchmarks.timing import best_seconds
from benchmarks.transport import base_plan
from coop_drake.fields import HarmonicMap, VelocityField
from coop_drake.planning import Plan
from coop_drake.simulation import build_maps

__all__ = ["bench_mapping"]

_TOLERANCE = 1e-4
_POINTS = 2000


def bench_mapping() -> list[Row]:
    """Solve, evaluate and judge the maps of the base plan."""
    _, plan = base_plan()
    cold, _ = _timed_maps(plan)
    warm, maps = _timed_maps(plan)
    certificates = [harmonic_map.certificate for harmonic_map in maps]
    unknowns = max(certificate.unknowns for certificate in certificates)
    dense = np.random.default_rng(0).normal(size=(unknowns, unknowns)) + unknowns * np.eye(unknowns)
    factor = best_seconds(lambda: np.linalg.solve(dense, dense[:, :2]), 1)
    residual = max(certificate.residual for certificate in certificates)
    return [
        Row("mapping/base/cells", len(maps), "cells"),
        Row("mapping/base/wall_seconds", warm, "s", "first time, operators cold", cold),
        Row("mapping/base/one_cell", warm / len(maps), "s", f"dense solve, {unknowns} unknowns", factor),
        Row("mapping/base/largest_residual", residual, "-", "tolerance", _TOLERANCE),
        *_evaluation(plan, maps),
    ]


def _evaluation(plan: Plan, maps: tuple[HarmonicMap, ...]) -> list[Row]:
    """Time one field at one point and at many, beside as many logarithms as the map has unknowns."""
    index = int(np.argmax([harmonic_map.certificate.unknowns for harmonic_map in maps]))
    harmonic_map, target = maps[index], plan.transitions[index].target
    field = VelocityField(harmonic_map)
    point = np.array(plan.cells[index].tidied.representative_point().coords[0])
    many = point + (target - point) * np.linspace(0.0, 1.0, _POINTS)[:, None]
    sources = np.linspace(1.0, 2.0, harmonic_map.certificate.unknowns)
    logs = 1e6 * best_seconds(lambda: [np.log(sources) for _ in range(_POINTS)], 3) / _POINTS
    single = 1e6 * best_seconds(lambda: [field(point) for _ in range(_POINTS)], 3) / _POINTS
    batch = 1e6 * best_seconds(lambda: harmonic_map(many), 3) / _POINTS
    peer = f"{len(sources)} logarithms in numpy"
    return [
        Row("mapping/base/field_at_one_point", single, "us", peer, logs),
        Row("mapping/base/map_and_jacobian_per_point", batch, "us", peer, logs),
    ]


def _timed_maps(plan: Plan) -> tuple[float, tuple[HarmonicMap, ...]]:
    start = perf_counter()
    maps = build_maps(plan, tolerance=_TOLERANCE)
    return perf_counter() - start, maps
