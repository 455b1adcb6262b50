"""What a user of the command line waits for and holds in memory: commands as they are typed."""

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
from benchmarks.timing import best_seconds

__all__ = ["bench_commands", "bench_help"]

_ROOT = Path(__file__).resolve().parents[1]
_CALL = (sys.executable, "-c", "from coop_drake.cli import main; main()")
_ANSWERED = (0, 3, 4)
_AIM = 250.0
"""What a plan should stay under [MB]."""


def bench_help() -> list[Row]:
    """Ask for help: what starting takes, beside a Python that does nothing."""
    asked = best_seconds(lambda: _called(["--help"]), 3)
    python = best_seconds(lambda: subprocess.run([sys.executable, "-c", ""], check=True), 3)
    return [Row("command/help/wall_seconds", asked, "s", "python that does nothing", python)]


def bench_commands(scenario: str) -> list[Row]:
    """Plan a shipped scenario in a fresh process: all that is waited for, and the largest resident memory.

    Args:
        scenario: Its name.
    """
    path = str(_ROOT / "models" / f"{scenario}.scenario.yaml")
    with TemporaryDirectory() as folder:
        wall, processor = perf_counter(), _children_cpu_seconds()
        facts: dict[str, Any] = json.loads(_called(["plan", path, "--out", folder, "--json", "--quiet"]))
        wall, processor = perf_counter() - wall, _children_cpu_seconds() - processor
    name = f"command/plan_{scenario}"
    return [
        Row(f"{name}/wall_seconds", wall, "s"),
        Row(f"{name}/cpu_seconds", processor, "s"),
        Row(f"{name}/peak_memory", facts["peak_memory_mb"], "MB", "aim", _AIM),
    ]


def _children_cpu_seconds() -> float:
    """CPU time of all processes that were started from here and are over."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def _called(arguments: Sequence[str]) -> str:
    """What a command says on standard output.

    Raises:
        WorkerError: It failed.
    """
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [*_CALL, *arguments], capture_output=True, text=True, check=False, cwd=_ROOT, env=environment
    )
    if done.returncode not in _ANSWERED:
        raise WorkerError(f"coop-drake {' '.join(arguments)} failed:\n{done.stderr[-1000:]}")
    return done.stdout
