"""Plans of shipped scenarios as commands in processes of their own: time and memory."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from benchmarks.isolated import WorkerError
from benchmarks.rows import Row

__all__ = ["bench_commands", "called", "children_cpu_seconds", "run_program"]

_ROOT = Path(__file__).resolve().parents[1]
_CALL = (sys.executable, "-c", "from coop_drake.cli import main; main()")
_ANSWERED = (0, 3, 4)
_LIMIT = 500.0
"""Memory that a plan may take [MB]."""


def bench_commands(scenario: str) -> list[Row]:
    """Plan a shipped scenario in a fresh process: all that is waited for, and the largest resident memory.

    Args:
        scenario: Its name.
    """
    path = str(_ROOT / "models" / f"{scenario}.scenario.yaml")
    with TemporaryDirectory() as folder:
        wall, processor = perf_counter(), children_cpu_seconds()
        facts: dict[str, Any] = json.loads(called(["plan", path, "--out", folder, "--json", "--quiet"]))
        wall, processor = perf_counter() - wall, children_cpu_seconds() - processor
    name = f"command/plan_{scenario}"
    return [
        Row(f"{name}/wall_seconds", wall, "s"),
        Row(f"{name}/cpu_seconds", processor, "s"),
        Row(f"{name}/peak_memory", facts["peak_memory_mb"], "MB", "limit", _LIMIT),
    ]


def children_cpu_seconds() -> float:
    """CPU time of all processes that were started from here and are over."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def called(arguments: Sequence[str]) -> str:
    """What a command says on standard output.

    Raises:
        WorkerError: It failed.
    """
    return run_program([*_CALL, *arguments])


def run_program(command: Sequence[str]) -> str:
    """Run a program with one thread of BLAS and with bytecode kept, as users do; return its standard output.

    Raises:
        WorkerError: It failed.
    """
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=_ROOT, env=environment)
    if done.returncode not in _ANSWERED:
        raise WorkerError(f"{' '.join(command)} failed:\n{done.stderr[-1000:]}")
    return done.stdout
