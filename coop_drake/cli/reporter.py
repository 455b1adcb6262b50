"""Talks to people through rich and to machines through one JSON object."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import perf_counter, process_time
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

__all__ = ["ProgressCallback", "Reporter"]

ProgressCallback = Callable[[str, float], None]

_SMALLEST_STEP = 0.002  # Progress that is worth drawing.
_NEARLY = 0.999


class Reporter:
    """Collects the facts of a command and shows them as they come.

    Args:
        machine: Whether standard output is for one JSON object, and everything else goes to standard error.
        quiet: Whether people want to see errors only.
    """

    def __init__(self, *, machine: bool, quiet: bool) -> None:
        self.facts: dict[str, Any] = {}
        self._machine = machine
        self._console = Console(stderr=machine, quiet=quiet, highlight=False)
        self._errors = Console(stderr=True, highlight=False)
        # Colours may be forced on a file, bars that are drawn over and over may not.
        stream = self._console.file
        self._moving = not quiet and stream.isatty() and not self._console.is_dumb_terminal

    @contextmanager
    def stage(self, name: str) -> Iterator[ProgressCallback]:
        """Show a progress bar while a stage runs, on a terminal only; yields the callback that moves it."""
        columns = (
            TextColumn("{task.description:<11}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TextColumn("[dim]{task.fields[doing]}"),
        )
        with Progress(*columns, console=self._console, disable=not self._moving) as bars:
            bar = bars.add_task(name, total=1.0, doing="")
            drawn = ("", 0.0)

            def advance(doing: str, fraction: float) -> None:
                nonlocal drawn
                if doing != drawn[0] or fraction - drawn[1] >= _SMALLEST_STEP:
                    drawn = (doing, fraction)
                    # A stage is over when it returns, whatever share of it is done.
                    bars.update(bar, completed=min(fraction, _NEARLY), doing=escape(doing))

            yield advance
            bars.update(bar, completed=1.0, doing="")

    @contextmanager
    def stopwatch(self, name: str, *, cpu: bool = False) -> Iterator[None]:
        """Note how long a stage took, even if it fails [s]."""
        wall, processor = perf_counter(), process_time()
        try:
            yield
        finally:
            self.facts[f"{name}_wall_seconds"] = round(perf_counter() - wall, 4)
            if cpu:
                self.facts[f"{name}_cpu_seconds"] = round(process_time() - processor, 4)

    def say(self, text: str) -> None:
        """Show a line of text, with rich's markup."""
        self._console.print(text, soft_wrap=True)

    def table(self, title: str, rows: Sequence[tuple[str, ...]], headings: Sequence[str] = ("",)) -> None:
        """Show the closing table.

        Args:
            title: Above it.
            rows: Label, then one value for each heading.
            headings: Of the columns of values.
        """
        table = Table(title=title, title_justify="left", show_header=any(headings))
        table.add_column(style="bold")
        for heading in headings:
            table.add_column(heading, justify="right")
        for row in rows:
            table.add_row(*row)
        self._console.print(table)

    def complain(self, text: str, **details: Any) -> None:
        """Show an error on standard error, and remember it and its details for the JSON object."""
        self.facts.update(error=text, **details)
        self._errors.print(f"[bold red]Error:[/] {escape(text)}", soft_wrap=True)

    def close(self) -> None:
        """Write the facts as one JSON object, if a machine asked for it."""
        if self._machine:
            sys.stdout.write(json.dumps({key: _plain(value) for key, value in self.facts.items()}) + "\n")
            sys.stdout.flush()


def _plain(value: Any) -> Any:
    """JSON knows neither infinities nor numpy's numbers."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
