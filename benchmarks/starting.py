"""How long commands take from the key press to the end, beside the import of all of Drake in the same run."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.commands import called, children_cpu_seconds, run_program
from benchmarks.rows import Row
from benchmarks.tasks import Task
from benchmarks.timing import seconds

__all__ = ["starting_tasks"]

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
