"""How long a stage takes to load and compile kernels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from coop_drake.kernel_times import KERNEL_TIMES


class KernelClock:
    """Time spent on kernels since it was made, not on what they compute."""

    def __init__(self) -> None:
        self._wall, self._cpu = KERNEL_TIMES.wall_seconds, KERNEL_TIMES.cpu_seconds

    @property
    def wall_seconds(self) -> float:
        """Elapsed wall-clock time [s]."""
        return KERNEL_TIMES.wall_seconds - self._wall

    @property
    def cpu_seconds(self) -> float:
        """Elapsed processor time [s]."""
        return KERNEL_TIMES.cpu_seconds - self._cpu


@contextmanager
def kernel_clock(compiling: Callable[[str], None]) -> Iterator[KernelClock]:
    """Measure what loading and compiling kernels takes until the block ends.

    Args:
        compiling: Called with the name of each kernel that is not in the cache, before it is compiled.
    """
    before, KERNEL_TIMES.compiling = KERNEL_TIMES.compiling, compiling
    try:
        yield KernelClock()
    finally:
        KERNEL_TIMES.compiling = before
