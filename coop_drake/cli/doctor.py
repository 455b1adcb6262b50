"""The command doctor: whether everything that the other commands need is there and works."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.guard import run_guarded
from coop_drake.cli.options import Machine
from coop_drake.cli.reporter import Reporter

__all__ = ["doctor_command"]

_MARKS = {True: "[green]ok[/]", False: "[red]wrong[/]", None: "[yellow]note[/]"}


def doctor_command(
    machine: Machine = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show what is wrong only.")] = False,
) -> None:
    """Check the installation: versions, Drake, Meshcat, fonts, compiled parts, memory, caches."""
    reporter = Reporter(machine=machine, quiet=quiet)

    def command() -> ExitCode:
        from coop_drake.cli.health import examine

        findings = examine()
        reporter.facts.update(
            healthy=all(finding.fine is not False for finding in findings),
            findings=[asdict(finding) for finding in findings],
        )
        rows = [(finding.what, f"{escape(finding.state)}  {_MARKS[finding.fine]}") for finding in findings]
        reporter.table("coop-drake doctor", rows)
        wrong = [finding for finding in findings if finding.fine is False]
        if wrong:
            remedies = "; ".join(f"{finding.what}: {finding.state}: {finding.remedy}" for finding in wrong)
            reporter.complain(remedies)
        for finding in findings:
            if finding.fine is None:
                reporter.say(f"{finding.what}: {escape(finding.remedy)}")
        return ExitCode.FAILED_RUN if wrong else ExitCode.DONE

    run_guarded(reporter, command)
