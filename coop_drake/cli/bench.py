"""The command bench: hands over to the benchmarks, where they are."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import typer

import coop_drake
from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.guard import run_guarded
from coop_drake.cli.reporter import Reporter
from coop_drake.errors import CoopDrakeError

__all__ = ["bench_command"]


def bench_command(context: typer.Context) -> None:
    """Measure speed and accuracy: alone it lists what there is, `bench all` measures everything.

    Arguments go to the benchmarks; `coop-drake bench -- --help` lists them.
    """
    reporter = Reporter(machine=False, quiet=False)
    run_guarded(reporter, lambda: _bench(context.args))


def _bench(arguments: list[str]) -> ExitCode:
    home = Path(coop_drake.__file__).resolve().parent.parent
    if not (home / "benchmarks" / "__main__.py").is_file():
        raise CoopDrakeError(
            f"{home}: benchmarks: are not here: an installed package comes without them; expected a clone of "
            "the repository, in which `make bench` measures everything"
        )
    command = [sys.executable, "-m", "benchmarks", *(arguments or ["--list"])]
    code = subprocess.run(command, cwd=home, check=False).returncode
    return ExitCode.DONE if code == 0 else ExitCode.FAILED_RUN
