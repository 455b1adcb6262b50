"""What one map costs and how good it is, beside the least that any method of its size takes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import process_time
from unittest.mock import patch

import numpy as np
import scipy.linalg
import shapely
from shapely import Point
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from benchmarks.domains import Domain
from benchmarks.rows import Row, best_seconds, seconds
from coop_drake.errors import FieldError
from coop_drake.harmonic_maps import HarmonicMap, solve

RESIDUAL = 1e-8
"""Largest residual on the boundary that a map may have; the estimated error is 2 M + 1 times that."""

_POINTS = 1_000
_QUICK = 0.3  # what takes no longer is timed several times [s]
_SLOW = 3.0  # what takes longer is done once [s]
_MOST_UNKNOWNS = 4_000  # larger dense systems take too long to be a peer


def _mapped(domain: Domain) -> HarmonicMap:
    """Map a domain to the residual that all rows are measured at.

    Raises:
        FieldError: It cannot be mapped as well as that.
    """
    around = not isinstance(domain.goal, Point) and domain.goal.distance(domain.cell.boundary) > 0.0
    holes = len(domain.cell.interiors) + around
    return HarmonicMap(domain.cell, domain.goal, tolerance=(2 * holes + 1) * RESIDUAL)


def map_rows(name: str, domain: Domain, hntf2d_residual: float | None = None) -> list[Row]:
    """Solve and judge a map, then evaluate it.

    Args:
        name: What the rows' names begin with.
        domain: What to map.
        hntf2d_residual: That of the authors' own implementation of such maps (hntf2d, single precision,
            3200 elements) on such a shape, if known.
    """
    rows, harmonic_map = _measured(name, domain, hntf2d_residual)
    return rows if harmonic_map is None else [*rows, *_evaluation_rows(name, harmonic_map)]


def cost_rows(name: str, domain: Domain) -> list[Row]:
    """Solve and judge a map; arguments as in `map_rows`."""
    return _measured(name, domain, None)[0]


def ablation_rows(name: str, domain: Domain) -> list[Row]:
    """CPU time of solving a map with compressed clusters of nodes, beside one dense system of all nodes."""
    _mapped(domain)
    compressed = _best(lambda: _mapped(domain))
    with patch.object(solve, "DENSE", sys.maxsize):
        dense = seconds(lambda: _mapped(domain), process_time)
    return [Row(f"{name}/cpu_seconds", compressed, "s", "without compression", dense)]


def _measured(
    name: str, domain: Domain, hntf2d_residual: float | None
) -> tuple[list[Row], HarmonicMap | None]:
    """Solve and judge one map, beside one dense system of as many unknowns; the map if there is one."""
    start = process_time()
    try:
        harmonic_map = _mapped(domain)
    except FieldError:
        return [Row(f"{name}/answer", 0.0, "refused"), Row(f"{name}/vertices", domain.vertices, "-")], None
    first = process_time() - start
    accuracy = harmonic_map.accuracy
    again = _best(lambda: _mapped(domain)) if first < _SLOW else first
    n = accuracy.unknowns
    peer = f"dense solve, {n} unknowns" if n <= _MOST_UNKNOWNS else ""
    peer_map = "" if hntf2d_residual is None else "hntf2d (3200 elements), measured apart"
    return [
        Row(f"{name}/answer", 1.0, "mapped"),
        Row(f"{name}/vertices", domain.vertices, "-"),
        Row(f"{name}/unknowns", n, "-"),
        Row(f"{name}/first_cpu_seconds", first, "s"),
        Row(f"{name}/cpu_seconds", again, "s", peer, _dense_seconds(n) if peer else None),
        Row(f"{name}/residual", accuracy.residual, "-", peer_map, hntf2d_residual),
    ], harmonic_map


def _evaluation_rows(name: str, harmonic_map: HarmonicMap) -> list[Row]:
    """T and J at one point and at a thousand, beside bare sums over as many sources in numpy."""
    low, high = np.reshape(harmonic_map.region.bounds, (2, 2))
    points = np.random.default_rng(0).uniform(low, high, (20 * _POINTS, 2))
    points = points[shapely.contains_xy(harmonic_map.region, *points.T)][:_POINTS]
    n = harmonic_map.accuracy.unknowns
    sources = np.exp(2j * np.pi * np.arange(n) / n)
    weights = np.column_stack((sources, 1j * sources))

    def sums(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        kernel = 1.0 / (sources - z[:, None])
        return kernel @ weights, (kernel * kernel) @ weights

    places = 0.5 * (points @ np.array([1.0, 1.0j])) / float(np.abs(high).max())
    one = _best(lambda: [harmonic_map(point) for point in points]) / len(points)
    many = _best(lambda: harmonic_map(points)) / len(points)
    with threadpool_limits(1, user_api="blas"):
        one_sum = _best(lambda: [sums(z) for z in places.reshape(-1, 1)]) / len(points)
        many_sums = _best(lambda: sums(places)) / len(points)
    peer = f"sums over {n} sources"
    return [
        Row(f"{name}/one_point", 1e6 * one, "us", peer, 1e6 * one_sum),
        Row(f"{name}/per_point_of_1000", 1e6 * many, "us", peer, 1e6 * many_sums),
    ]


def _best(work: Callable[[], object]) -> float:
    """CPU time of a call, the shortest of some if it is quick [s]."""
    first = seconds(work, process_time)
    return first if first > _QUICK else min(first, best_seconds(work, 3, clock=process_time))


def _dense_seconds(unknowns: int) -> float:
    """CPU time of one dense system with two right-hand sides, on one thread [s]."""
    random = np.random.default_rng(0)
    matrix = random.normal(size=(unknowns, unknowns)) + unknowns * np.eye(unknowns)
    right = random.normal(size=(unknowns, 2))
    with threadpool_limits(1, user_api="blas"):
        return _best(lambda: scipy.linalg.solve(matrix, right, check_finite=False))
