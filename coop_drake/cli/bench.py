"""The command bench: hands over to the benchmarks, where they are."""

from __future__ import annotations

import subprocess
import sys

import typer

from coop_drake.cli.clone import root_of_clone
from coop_drake.cli.reporter import ExitCode, reporting


def bench_command(context: typer.Context) -> None:
    """Measure speed and accuracy: alone it lists what there is, `bench all` measures everything.

    Arguments go to the benchmarks; `coop-drake bench -- --help` lists them.
    """
    with reporting() as reporter:
        reporter.code = _bench(context.args)


def _bench(arguments: list[str]) -> ExitCode:
    command = [sys.executable, "-m", "benchmarks", *(arguments or ["--list"])]
    code = subprocess.run(command, cwd=root_of_clone("benchmarks"), check=False).returncode
    return ExitCode.DONE if code == 0 else ExitCode.FAILED_RUN
