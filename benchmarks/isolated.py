"""Work in a process of its own: its CPU time, its peak memory, and a limit that it cannot outlast."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from coop_drake.errors import CoopDrakeError

T = TypeVar("T")

GRACE = 15
"""Compiled code cannot be interrupted; so much longer it may run before it is killed [CPU s]."""
_ROOT = Path(__file__).resolve().parents[1]
_KILLED = (-signal.SIGKILL, -signal.SIGXCPU)
_LAST_LINES = 12
_running: set[subprocess.Popen[bytes]] = set()


class WorkerError(CoopDrakeError):
    """A measured piece of work failed."""


@dataclass(frozen=True)
class Isolated(Generic[T]):
    """What came of a piece of work.

    Attributes:
        value: What it returned, None if it ran out of time.
        cpu_seconds: CPU time of the whole work, without starting Python and importing.
        peak_mb: Largest resident memory of its process [MB], None if it had to be killed.
    """

    value: T | None
    cpu_seconds: float
    peak_mb: float | None


def in_own_process(work: Callable[..., T], *arguments: Any, limit: float) -> Isolated[T]:
    """Call a function in a fresh Python process.

    Args:
        work: A function of a module, so that the other process finds it by name.
        arguments: Its arguments; like the result they are pickled on the way.
        limit: CPU time it may take, rounded up to whole seconds [s].

    Raises:
        WorkerError: The function raised, or its process died of anything but the limit.
    """
    with subprocess.Popen(
        [sys.executable, "-m", "benchmarks.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=_ROOT,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        start_new_session=True,  # Ctrl-C is answered here, where results are kept.
    ) as process:
        _running.add(process)
        try:
            answer, complaints = process.communicate(pickle.dumps((work, arguments, limit)))
        finally:
            process.kill()
            _running.discard(process)
    if process.returncode in _KILLED:
        return Isolated(None, limit + GRACE, None)
    if process.returncode != 0:
        last = complaints.decode(errors="replace").splitlines()[-_LAST_LINES:]
        called = getattr(work, "func", work)
        raise WorkerError(f"{called.__module__}.{called.__qualname__} failed:\n" + "\n".join(last))
    result: Isolated[T] = pickle.loads(answer)
    return result


def stop_all() -> None:
    """Kill every process that is at work; whoever waits for one sees it as out of time."""
    for process in tuple(_running):
        process.kill()
