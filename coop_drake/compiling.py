"""What a process spends on compiling functions, and how far it is; no compiler is imported here."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from threading import Lock, local
from time import perf_counter, thread_time

_BETWEEN_LINES = 10.0
"""Least time between two lines about compiling where standard error is no terminal [s]."""


@dataclass
class Compiling:
    """What this process spends on loading and compiling functions, not on what they compute.

    Attributes:
        wall_seconds: Elapsed wall-clock time in which any thread did so [s].
        cpu_seconds: Elapsed CPU time of all threads [s].
        functions: How many functions of the modules imported so far can be compiled; few calls need all.
        names: Those that were compiled.
        tell: Called with the name of each one when it is compiled; None if nobody waits for it.
    """

    wall_seconds: float = 0.0
    cpu_seconds: float = 0.0
    functions: int = 0
    names: set[str] = field(default_factory=set)
    tell: Callable[[str], None] | None = None

    def __post_init__(self) -> None:
        """Prepare what each thread has of its own."""
        self._thread, self._told, self._line = local(), -math.inf, False
        self._lock, self._busy, self._since = Lock(), 0, 0.0

    @contextmanager
    def spent(self) -> Iterator[None]:
        """Add the time of a block; a block inside another one counts once."""
        processor, outer = thread_time(), getattr(self._thread, "inside", False)
        self._thread.inside = True
        if not outer:
            with self._lock:  # threads that wait for one function are counted as one
                self._since = self._since if self._busy else perf_counter()
                self._busy += 1
        try:
            yield
        finally:
            self._thread.inside = outer
            if not outer:
                with self._lock:
                    self._busy -= 1
                    if not self._busy:
                        self.wall_seconds += perf_counter() - self._since
                    self.cpu_seconds += thread_time() - processor
                if self._line:
                    sys.stderr.write("\r\033[K")
                    self._line = False

    def announce(self, name: str) -> None:
        """Say that a function was compiled."""
        self.names.add(name)
        if self.tell is not None:
            self.tell(name)

    @property
    def count(self) -> str:
        """How far compiling is."""
        return f"{len(self.names)} of at most {self.functions}"

    def show(self, name: str) -> None:
        """Show on standard error what was compiled: in one line of a terminal, otherwise now and then."""
        text = f"coop_drake compiles its functions at their first call: {self.count}"
        if sys.stderr.isatty():
            sys.stderr.write(f"\r{text}, {name}\033[K")
            sys.stderr.flush()
            self._line = True
        elif perf_counter() - self._told >= _BETWEEN_LINES:
            self._told = perf_counter()
            sys.stderr.write(f"{text}; later processes load them\n")


COMPILING = Compiling()
"""That of this process."""
COMPILING.tell = COMPILING.show


class KernelClock:
    """Time spent on kernels since it was made, not on what they compute."""

    def __init__(self) -> None:
        self._wall, self._cpu = COMPILING.wall_seconds, COMPILING.cpu_seconds

    @property
    def wall_seconds(self) -> float:
        """Elapsed wall-clock time [s]."""
        return COMPILING.wall_seconds - self._wall

    @property
    def cpu_seconds(self) -> float:
        """Elapsed processor time [s]."""
        return COMPILING.cpu_seconds - self._cpu


@contextmanager
def kernel_clock(compiling: Callable[[str], None]) -> Iterator[KernelClock]:
    """Measure what loading and compiling kernels takes until the block ends.

    Args:
        compiling: Called with the name of each kernel that is not in the cache, before it is compiled.
    """
    before, COMPILING.tell = COMPILING.tell, compiling
    try:
        yield KernelClock()
    finally:
        COMPILING.tell = before
