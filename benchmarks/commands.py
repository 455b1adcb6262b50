"""Commands from start to end, beside the import of all of Drake: time and memory."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

from benchmarks.isolated import WorkerError
from benchmarks.rows import Row, seconds
from benchmarks.tasks import Task

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


_REPEATS = 3
"""Each figure is the smallest of so many; the first of them also loads files into memory."""

_MEMORY_LIMITS = {"plan_base": 500.0, "run_base": 700.0}
"""What the commands may hold in memory [MB]."""

_DRAKE = "python -c 'import pydrake.all'"


def starting_tasks() -> list[Task]:
    """All commands are measured together, for their figures are ratios."""
    return [Task("starting/commands", lambda rows: _rows(), alone=True)]


def _rows() -> list[Row]:
    with TemporaryDirectory() as folder:
        results = Path(folder)
        answer = str(results / "plan.json")
        out = ["--out", folder, "--json", "--quiet"]
        facts: dict[str, str] = {}

        def command(name: str, *arguments: str) -> Callable[[], object]:
            return lambda: facts.update({name: called(arguments)})

        nothing = _python("pass")
        drake = _least(_python("import pydrake.all"))
        rows = _beside("import_coop_drake", _least(_python("import coop_drake")), "python", _least(nothing))
        for name, work in (
            ("help", command("help", "--help")),
            ("plan_base", command("plan_base", "plan", "base", *out)),
            ("verify_base", command("verify_base", "verify", answer, "base", "--json", "--quiet")),
            ("run_base", command("run_base", "run", "base", *out)),
        ):
            rows += _beside(name, _least(work), _DRAKE, drake)
        for name, limit in _MEMORY_LIMITS.items():
            peak = json.loads(facts[name])["peak_memory_mb"]
            rows.append(Row(f"starting/commands/{name}/peak_memory", peak, "MB", "limit", limit))
    return rows


def _python(code: str) -> Callable[[], object]:
    return lambda: run_program([sys.executable, "-c", code])


def _least(work: Callable[[], object]) -> tuple[float, float]:
    """Smallest time by the clock on the wall and by the processor of some calls [s]."""
    times = [(seconds(work), 0.0)]
    for _ in range(_REPEATS):
        before = children_cpu_seconds()
        wall = seconds(work)
        times.append((wall, children_cpu_seconds() - before))
    walls, processor = zip(*times[1:], strict=True)
    return min(walls), min(processor)


def _beside(name: str, own: Sequence[float], peer: str, other: Sequence[float]) -> list[Row]:
    return [
        Row(f"starting/commands/{name}/{figure}", value, "s", peer, beside)
        for figure, value, beside in zip(("wall_seconds", "cpu_seconds"), own, other, strict=True)
    ]
