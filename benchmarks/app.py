"""``python -m benchmarks``: measures, writes out/bench.json as it goes, and shows tables."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from benchmarks.ledger import Ledger
from benchmarks.mapping import bench_mapping
from benchmarks.planner.ablation import ablation_tasks
from benchmarks.planner.cases import CASES
from benchmarks.planner.growth import growth_tasks
from benchmarks.planner.head_to_head import Effort, compare
from benchmarks.planner.ompl_peer import has_ompl
from benchmarks.rows import Row
from benchmarks.simulating import bench_simulation
from benchmarks.table import show
from benchmarks.tasks import Task, chosen
from coop_drake.errors import CoopDrakeError

__all__ = ["app"]

_RESULTS = Path("out/bench.json")
_FAILED, _BAD_USE, _INTERRUPTED = 1, 2, 130
_GROWTH_LIMIT = 20.0

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def main(
    topics: Annotated[
        list[str] | None,
        typer.Argument(metavar="[TOPIC]...", help="planner, mapping, simulating; all by default."),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(help="A case or growth axis, like base, growth or robots; may be repeated."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Runs of every peer.")] = 10,
    budget: Annotated[float, typer.Option(min=0.1, help="CPU seconds of every run of OMPL.")] = 10.0,
    limit: Annotated[
        float, typer.Option(min=1.0, help="CPU seconds of every answer of ours.")
    ] = _GROWTH_LIMIT,
    out: Annotated[Path, typer.Option(help="Where the rows go.")] = _RESULTS,
) -> None:
    """Measure what exists on this machine, each figure beside a peer of the same run."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    console = Console(stderr=True, highlight=False)
    tasks = chosen(_tasks(Effort(seeds, budget, limit)), topics or [], only or [])
    if not tasks:
        console.print(
            f"[bold red]Error:[/] nothing is called {escape(' '.join([*(topics or []), *(only or [])]))}"
        )
        raise typer.Exit(_BAD_USE)
    if not has_ompl():
        console.print("OMPL is not installed, so its rows are left out: pip install 'coop-drake[bench]'")
    try:
        ledger = Ledger(out, fresh=not topics and not only)
    except CoopDrakeError as error:
        console.print(f"[bold red]Error:[/] {escape(str(error))}", soft_wrap=True)
        raise typer.Exit(_BAD_USE) from error
    code = _measure(tasks, ledger, console)
    show(ledger.rows)
    console.print(f"{len(ledger.rows)} rows are in {escape(str(out))}")
    raise typer.Exit(code)


def _tasks(effort: Effort) -> list[Task]:
    """Everything there is to measure."""
    return [
        *[Task(f"planner/{case.name}", lambda case=case: compare(case, effort)) for case in CASES],
        *ablation_tasks(effort.limit),
        *growth_tasks(effort.limit),
        Task("mapping/base", bench_mapping),
        Task("simulating/base", bench_simulation),
    ]


def _measure(tasks: list[Task], ledger: Ledger, console: Console) -> int:
    """Work through the tasks; what is measured is kept even if one fails or Ctrl-C ends the work."""
    code = 0
    try:
        for rows, error in _worked(tasks, console):
            ledger.add(rows)
            if error is not None:
                console.print(f"[bold red]Error:[/] {escape(str(error))}", soft_wrap=True)
                code = _FAILED
    except KeyboardInterrupt:
        console.print("Interrupted: what was measured until now is kept.")
        return _INTERRUPTED
    return code


def _worked(tasks: list[Task], console: Console) -> Iterator[tuple[list[Row], CoopDrakeError | None]]:
    columns = (TextColumn("{task.description:<32}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bars:
        bar = bars.add_task("", total=len(tasks))
        for task in tasks:
            bars.update(bar, description=task.name)
            try:
                yield task.measure(), None
            except CoopDrakeError as error:
                yield [], error
            bars.advance(bar)
