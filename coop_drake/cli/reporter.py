"""How a command reports: progress and tables for people, facts as JSON for machines, errors, exit codes."""

from __future__ import annotations

import json
import math
import resource
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import IntEnum
from functools import partial
from time import perf_counter, thread_time
from typing import Any

import typer
from rich.console import Console
from rich.markup import escape

from coop_drake.compiling import COMPILING, kernel_clock
from coop_drake.errors import (
    CoopDrakeError,
    FieldError,
    FloorPlanError,
    MessagingError,
    ProcessError,
    ScenarioError,
    StallError,
)
from coop_drake.extras import install_advice
from coop_drake.files import plain_numbers
from coop_drake.progress import Progress

UsageError: Any = typer.BadParameter.__base__
"""Wrong usage: the same base in typer's own click and in the package click."""

_SMALLEST_STEP = 0.002
"""Fraction by which a bar moves on; smaller steps cannot be seen on a terminal [-]."""
_NEARLY = 0.999
"""Where a bar stops until its stage returns: only then it is over [-]."""
_BETWEEN_LINES = 10.0
"""Least time between two lines about compiling where there is no bar, as in a log file [s]."""


class ExitCode(IntEnum):
    """What a command tells the shell that called it."""

    DONE = 0
    FAILED_RUN = 1
    BAD_INPUT = 2
    INFEASIBLE = 3
    UNDECIDED = 4
    BEYOND_LIMITS = 5
    INTERRUPTED = 130

    @classmethod
    def of(cls, answer: str) -> ExitCode:
        """Return the code for an answer as ``answer_of`` gives it; any other one is undecided."""
        codes = {"found": cls.DONE, "infeasible": cls.INFEASIBLE, "beyond limits": cls.BEYOND_LIMITS}
        return codes.get(answer, cls.UNDECIDED)


class Reporter:
    """Collects the facts of a command and shows them as they come.

    Args:
        machine: Whether standard output is for one JSON object, and everything else goes to standard error.
        quiet: Whether only errors are shown.
        verbose: Whether closing tables show more rows.

    Attributes:
        facts: What ``--json`` writes, by name.
        code: The exit code of the command.
        verbose: As given.
        silent: Whether nobody reads what is shown but errors.
        complained: Whether any command of this process has shown an error.
    """

    complained = False

    def __init__(self, *, machine: bool, quiet: bool, verbose: bool = False) -> None:
        self.verbose, self.silent = verbose, machine or quiet
        self.facts: dict[str, Any] = {}
        self.code = ExitCode.DONE
        self._machine = machine
        self._compiled_said = -math.inf
        self._console = Console(stderr=machine, quiet=quiet, highlight=False, emoji=False)
        self._errors = Console(stderr=True, highlight=False, emoji=False)
        # Colours may be forced on a file, bars that are drawn over and over may not.
        stream = self._console.file
        self._moving = not quiet and stream.isatty() and not self._console.is_dumb_terminal

    @contextmanager
    def stage(self, name: str, facts: str = "", *, cpu: bool = False) -> Iterator[Progress]:
        """Show a progress bar while a stage runs, on a terminal only.

        Args:
            name: What is shown.
            facts: Name under which the seconds of the stage are noted, even if it fails. Seconds that pass
                while kernels are loaded or compiled are noted as ``loading``: they depend on the cache.
            cpu: Whether the seconds of the processor are noted, too: those of this thread, and of processes
                that end with the stage.

        Yields:
            The callback that moves the bar.
        """
        wall, processor = perf_counter(), _processor_seconds()
        with (
            self._bar(name) as advance,
            kernel_clock(partial(self._compiling, advance)) as kernels,
        ):
            try:
                yield advance
            finally:
                if facts:
                    self._add("loading_cpu_seconds", kernels.cpu_seconds)
                    self._add(f"{facts}_wall_seconds", perf_counter() - wall - kernels.wall_seconds)
                    if cpu:
                        own = _processor_seconds() - processor
                        self._add(f"{facts}_cpu_seconds", own - kernels.cpu_seconds)

    def _add(self, fact: str, seconds: float) -> None:
        self.facts[fact] = round(self.facts.get(fact, 0.0) + seconds, 4)

    def _compiling(self, advance: Progress, kernel: str) -> None:
        """Say how many functions are compiled: in the bar, or in a line every few seconds."""
        if self._moving:
            advance(f"compiled {COMPILING.count} functions, {kernel} (first run only)", 0.0)
        elif perf_counter() - self._compiled_said >= _BETWEEN_LINES:
            self._compiled_said = perf_counter()
            self.say(f"Compiled {COMPILING.count} functions; later runs load them from the cache")

    @contextmanager
    def _bar(self, name: str) -> Iterator[Progress]:
        if not self._moving:
            yield lambda doing, fraction: None
            return
        # Here: to import bars and tables takes a fiftieth of a command, and not every one shows them.
        from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as ProgressBars

        columns = (
            TextColumn("{task.description:<11}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TextColumn("[dim]{task.fields[doing]}"),
        )
        with ProgressBars(*columns, console=self._console) as bars:
            bar = bars.add_task(name, total=1.0, doing="")
            drawn = ("", 0.0)

            def advance(doing: str, fraction: float) -> None:
                nonlocal drawn
                if doing != drawn[0] or fraction - drawn[1] >= _SMALLEST_STEP:
                    drawn = (doing, max(fraction, drawn[1]))
                    bars.update(bar, completed=min(drawn[1], _NEARLY), doing=escape(doing))

            yield advance
            bars.update(bar, completed=1.0, doing="")

    def say(self, text: str) -> None:
        """Show a line of text, with rich's markup."""
        self._console.print(text, soft_wrap=True)

    def note(self, sentences: Sequence[str]) -> None:
        """Show and note sentences about what a reader left out or assumed; without any nothing changes."""
        if sentences:
            self.facts["notes"] = [*self.facts.get("notes", ()), *sentences]
        for sentence in sentences:
            self.say(f"Note: {escape(sentence)}")

    def table(
        self,
        title: str,
        rows: Sequence[tuple[str, ...]],
        headings: Sequence[str] = ("",),
        first: str = "",
        *,
        padding: int = 1,
    ) -> None:
        """Show a table: of every row the label, under the first heading, then a value for each other one.

        Args:
            title: What stands above.
            rows: The rows.
            headings: Of the values.
            first: Heading of the labels.
            padding: Spaces on both sides of every value; none for tables of many columns.
        """
        if self._console.quiet:
            return
        from rich.table import Table

        table = Table(title=title, title_justify="left", show_header=any(headings), padding=(0, padding))
        table.add_column(first, style="bold")
        for heading in headings:
            table.add_column(heading, justify="right")
        for row in rows:
            table.add_row(*row)
        self._console.print(table)

    def complain(self, text: str, **details: Any) -> None:
        """Show an error on standard error, and remember it and its details for the JSON object."""
        self.facts.update(error=text, **details)
        Reporter.complained = True
        self._errors.print(f"[bold red]Error:[/] {escape(text)}", soft_wrap=True)

    def close(self) -> None:
        """Write the facts as one JSON object, if a machine asked for it."""
        if self._machine:
            sys.stdout.write(json.dumps(plain_numbers(self.facts)) + "\n")
            sys.stdout.flush()


def _processor_seconds() -> float:
    """Time of the processor in this thread and in child processes that have ended [s]."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return thread_time() + ended.ru_utime + ended.ru_stime


@contextmanager
def reporting(*, machine: bool = False, quiet: bool = False, verbose: bool = False) -> Iterator[Reporter]:
    """Run the body of a command, which sets ``reporter.code``, and leave with that exit code.

    With ``machine`` standard output is for one JSON object, with ``quiet`` only errors are shown, with
    ``verbose`` closing tables have more rows.

    Raises:
        typer.Exit: Always, with the exit code, unless the body raises an error that is a bug, or one that
            says that the command was called wrongly.
    """
    reporter = Reporter(machine=machine, quiet=quiet, verbose=verbose)
    try:
        try:
            yield reporter
        except BaseException as error:
            if not _explain(error, reporter):
                raise
    except UsageError:  # Who calls the command says it, to machines, too.
        raise
    except BaseException:
        reporter.close()
        raise
    reporter.close()
    raise typer.Exit(int(reporter.code))


def _explain(error: BaseException, reporter: Reporter) -> bool:
    """Report an error and its exit code; False for a bug, and for what is no error of the body."""
    details: dict[str, object] = {}
    text, code = str(error), ExitCode.BAD_INPUT
    if _is_interrupt(error):
        text, code = "interrupted; files already written are whole", ExitCode.INTERRUPTED
    elif isinstance(error, ScenarioError):
        details = {"file": error.file, "key": error.key, "value": error.shown, "allowed": error.allowed}
    elif isinstance(error, FloorPlanError):
        details = {"file": error.file, "place": error.place, "remedy": error.remedy, "finding": error.finding}
    elif isinstance(error, FieldError | MessagingError | ProcessError | StallError):
        code = ExitCode.FAILED_RUN
    elif isinstance(error, ModuleNotFoundError) and (advice := install_advice(error.name or "")):
        text = f"the package {error.name} is not installed; install what this needs: {advice}"
    elif isinstance(error, OSError):
        text = _system_error(error)
    elif not isinstance(error, CoopDrakeError):
        if isinstance(error, Exception) and not isinstance(error, UsageError):
            reporter.complain(f"{type(error).__name__}: {error}")
        return False
    reporter.complain(text, **details)
    reporter.code = code
    return True


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused an error: compiled code and imports that it ends raise errors of their own."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _system_error(error: OSError) -> str:
    """What the operating system refused, as a sentence that names the file and what would help."""
    if error.filename is None or error.strerror is None:
        return str(error)
    if isinstance(error, FileExistsError | NotADirectoryError):
        return f"{error.filename}: a file stands where a folder is needed; expected another place, with --out"
    return f"{error.filename}: {error.strerror.lower()}; expected a place that can be read and written"
