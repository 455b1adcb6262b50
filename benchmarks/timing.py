"""Stopwatches."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

__all__ = ["best_seconds"]


def best_seconds(work: Callable[[], object], repeats: int) -> float:
    """Return the shortest of several wall times [s]; the first call warms caches and does not count."""
    work()
    times = []
    for _ in range(repeats):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)
