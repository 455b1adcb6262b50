"""How long numba takes to load and compile kernels, and which one it compiles now."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter, thread_time
from typing import Any


@dataclass
class KernelClock:
    """Time spent on kernels, not on what they compute.

    Attributes:
        wall_seconds: By the clock on the wall [s].
        cpu_seconds: By the processor [s].
    """

    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0


@contextmanager
def kernel_clock(compiling: Callable[[str], None]) -> Iterator[KernelClock]:
    """Measure numba's work until the block ends; nothing where numba has not been imported.

    Args:
        compiling: Called with the name of each kernel that is not in the cache, before it is compiled.
    """
    clock = KernelClock()
    if "numba" not in sys.modules:
        yield clock
        return
    from numba.core import event

    class Stopwatch(event.Listener):
        """Adds up what passes while numba's lock is held: to look a kernel up, to load and to compile it."""

        depth = 0

        def on_start(self, event: Any) -> None:
            if self.depth == 0:
                self.begun = perf_counter(), thread_time()
            self.depth += 1

        def on_end(self, event: Any) -> None:
            self.depth -= 1
            if self.depth == 0:
                clock.wall_seconds += perf_counter() - self.begun[0]
                clock.cpu_seconds += thread_time() - self.begun[1]

    class Announcer(event.Listener):
        """Names each kernel that is compiled."""

        def on_start(self, event: Any) -> None:
            compiling(event.data["dispatcher"].py_func.__name__)

        def on_end(self, event: Any) -> None:
            pass

    with (
        event.install_listener("numba:compiler_lock", Stopwatch()),
        event.install_listener("numba:compile", Announcer()),
    ):
        yield clock
