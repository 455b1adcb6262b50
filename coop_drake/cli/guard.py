"""Turns errors into a sentence and an exit code; only bugs show a traceback."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import typer

from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.reporter import Reporter
from coop_drake.errors import CoopDrakeError, FieldError, FloorPlanError, ScenarioError, StallError

_EXTRAS = {
    "collada": "robots",
    "defusedxml": "robots",
    "ezdxf": "floor-plans",
    "svgelements": "floor-plans",
    "trimesh": "robots",
}
"""The extra of coop-drake that installs a package which only some commands import."""


@contextmanager
def reporting(*, machine: bool = False, quiet: bool = False) -> Iterator[Reporter]:
    """Run the body of a command, which sets ``reporter.code``, and leave with that exit code.

    Args:
        machine: Whether standard output is for one JSON object.
        quiet: Whether only errors are shown.

    Raises:
        typer.Exit: Always, with the exit code, unless the body raises an error that is a bug.
    """
    reporter = Reporter(machine=machine, quiet=quiet)
    try:
        try:
            yield reporter
        except BaseException as error:
            if not _explain(error, reporter):
                raise
    finally:
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
    elif isinstance(error, FieldError | StallError):
        code = ExitCode.FAILED_RUN
    elif isinstance(error, ModuleNotFoundError) and error.name in _EXTRAS:
        extra = _EXTRAS[error.name]
        text = f"the package {error.name} is not installed; expected: pip install 'coop-drake[{extra}]'"
    elif isinstance(error, OSError):
        text = _system_error(error)
    elif not isinstance(error, CoopDrakeError):
        if isinstance(error, Exception):
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
