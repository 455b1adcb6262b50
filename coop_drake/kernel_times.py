"""How long it takes to load and compile kernels, and which one is compiled now."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import RLock
from time import perf_counter, thread_time


@dataclass
class KernelTimes:
    """Time that this process has spent on kernels, not on what they compute.

    Attributes:
        wall_seconds: Elapsed wall-clock time [s].
        cpu_seconds: Elapsed CPU time [s].
        functions: How many functions of the modules imported so far can be compiled; few commands need all.
        compiling: Called with the name of each function before it is compiled, None if nobody waits for it.
    """

    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0
    functions: int = 0
    compiling: Callable[[str], None] | None = None

    def __post_init__(self) -> None:
        """Make the lock: kernels are loaded one at a time."""
        self._lock, self._depth = RLock(), 0

    @contextmanager
    def spent(self) -> Iterator[None]:
        """Add the time of a block; one of another thread waits, and one inside it counts once."""
        with self._lock:
            wall, processor = perf_counter(), thread_time()
            self._depth += 1
            try:
                yield
            finally:
                self._depth -= 1
                if self._depth == 0:
                    self.wall_seconds += perf_counter() - wall
                    self.cpu_seconds += thread_time() - processor

    def announce(self, name: str) -> None:
        """Say that a function is compiled now."""
        if self.compiling is not None:
            self.compiling(name)


KERNEL_TIMES = KernelTimes()
"""Those of this process."""
