"""Stopwatches."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

__all__ = ["best_seconds", "seconds"]


def best_seconds(
    work: Callable[[], object], repeats: int, *, clock: Callable[[], float] = perf_counter
) -> float:
    """Return the shortest of several times [s]; the first call warms caches and does not count.

    Args:
        work: What to time.
        repeats: How many times.
        clock: Tells the time [s]: wall time by default.
    """
    work()
    return min(seconds(work, clock) for _ in range(repeats))


def seconds(work: Callable[[], object], clock: Callable[[], float] = perf_counter) -> float:
    """Return what one call takes [s]; arguments as in `best_seconds`."""
    start = clock()
    work()
    return clock() - start
