"""Turns what can go wrong into a sentence and an exit code; no traceback for a user's mistake."""

from __future__ import annotations

from collections.abc import Callable

import typer

from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.reporter import Reporter
from coop_drake.errors import CoopDrakeError, FieldError, FloorPlanError, ScenarioError, StallError

__all__ = ["run_guarded"]


def run_guarded(reporter: Reporter, command: Callable[[], ExitCode]) -> None:
    """Run a command to its end and leave with its exit code.

    Args:
        reporter: Where errors go; it is closed in any case.
        command: The command; returns its exit code.

    Raises:
        typer.Exit: Always, with the exit code.
    """
    try:
        code = _attempt(reporter, command)
    finally:
        reporter.close()
    raise typer.Exit(int(code))


def _attempt(reporter: Reporter, command: Callable[[], ExitCode]) -> ExitCode:
    try:
        return command()
    except KeyboardInterrupt:
        return _interrupted(reporter)
    except ScenarioError as error:
        details = {"file": error.file, "key": error.key, "value": error.shown, "allowed": error.allowed}
        reporter.complain(str(error), **details)
        return ExitCode.BAD_INPUT
    except FloorPlanError as error:
        details = {"file": error.file, "place": error.place, "remedy": error.remedy}
        reporter.complain(str(error), finding=error.finding, **details)
        return ExitCode.BAD_INPUT
    except (FieldError, StallError) as error:
        reporter.complain(str(error))
        return ExitCode.FAILED_RUN
    except CoopDrakeError as error:
        reporter.complain(str(error))
        return ExitCode.BAD_INPUT
    except OSError as error:
        reporter.complain(_of_the_system(error))
        return ExitCode.BAD_INPUT
    except Exception as error:
        if _came_of_ctrl_c(error):
            return _interrupted(reporter)
        # A bug, not a mistake of the user's: machines get their object, people the traceback.
        reporter.complain(f"{type(error).__name__}: {error}")
        raise


def _interrupted(reporter: Reporter) -> ExitCode:
    reporter.complain("interrupted; files already written are whole")
    return ExitCode.INTERRUPTED


def _came_of_ctrl_c(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: compiled code and imports that it ends raise errors of their own."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _of_the_system(error: OSError) -> str:
    """What the system would not do, as a sentence that names the file and what would help."""
    if error.filename is None or error.strerror is None:
        return str(error)
    if isinstance(error, FileExistsError | NotADirectoryError):
        return f"{error.filename}: a file stands where a folder is needed; expected another place, with --out"
    return f"{error.filename}: {error.strerror.lower()}; expected a place that can be read and written"
