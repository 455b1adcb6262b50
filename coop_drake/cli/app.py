"""The commands: run, plan, simulate."""

from __future__ import annotations

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.chain import Task, load_task, plan_task, read_plan, simulate_task, warm_up, write_pictures
from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.guard import run_guarded
from coop_drake.cli.measures import answer_of
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import summary_rows
from coop_drake.cli.verify import verify_command
from coop_drake.cli.watch import watch_command
from coop_drake.cli.why import why_command
from coop_drake.planning import Found, Plan

__all__ = ["app", "main"]

_UsageError = typer.BadParameter.__base__  # The same base in typer's own click and in the package click.

app = typer.Typer(
    name="coop-drake",
    help="Plan, map, control and simulate several mobile manipulators that carry one object.",
    epilog="Exit codes: 0 done, 1 failed run, 2 bad input, 3 infeasible, 4 undecided, 130 interrupted.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

ScenarioPath = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (*.scenario.yaml).")]
OutPath = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", file_okay=False, help="Where results go; out/<scenario> by default."
    ),
]
GainsName = Annotated[
    str | None, typer.Option("--gains", metavar="NAME", help="Gain set; the scenario's choice by default.")
]
Machine = Annotated[
    bool, typer.Option("--json", help="One JSON object on standard output, all else on standard error.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show errors only.")]


def main() -> None:
    """Run the command line; wrong usage is answered like any bad input."""
    arguments = sys.argv[1:]
    try:
        code = app(arguments, standalone_mode=False)
    except _UsageError as error:  # type: ignore[misc]
        error.show()
        if "--json" in arguments:
            sys.stdout.write(json.dumps({"error": error.format_message()}) + "\n")
        code = ExitCode.BAD_INPUT
    sys.exit(int(code or 0))


@app.callback(invoke_without_command=True)
def show_version(
    show: Annotated[bool, typer.Option("--version", help="Show the version.", is_eager=True)] = False,
) -> None:
    """Carry one object with many hands."""
    if show:
        typer.echo(f"coop_drake {version('coop-drake')}")
        raise typer.Exit


@app.command("run")
def run_command(
    scenario: ScenarioPath,
    out: OutPath = None,
    gains: GainsName = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Plan, map, simulate and record a transport."""
    reporter = Reporter(machine=machine, quiet=quiet)

    def command() -> ExitCode:
        task = load_task(scenario, gains)
        folder = _folder(task, out)
        result = plan_task(task, folder, reporter)
        if not isinstance(result, Found):
            return _no_plan(task, answer_of(result), result.reason, folder, reporter)
        return _carry_out(task, result.plan, folder, reporter)

    run_guarded(reporter, command)


@app.command("plan")
def plan_command(
    scenario: ScenarioPath,
    out: OutPath = None,
    gains: GainsName = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Plan only: write the plan, or say why there is none."""
    reporter = Reporter(machine=machine, quiet=quiet)

    def command() -> ExitCode:
        task = load_task(scenario, gains)
        folder = _folder(task, out)
        result = plan_task(task, folder, reporter)
        if not isinstance(result, Found):
            return _no_plan(task, answer_of(result), result.reason, folder, reporter)
        reporter.table(task.scenario.name, summary_rows(reporter.facts))
        reporter.say(f"The plan is in {escape(str(folder.plan))}")
        return ExitCode.DONE

    run_guarded(reporter, command)


@app.command("simulate")
def simulate_command(
    scenario: ScenarioPath,
    plan: Annotated[
        Path | None,
        typer.Option("--plan", metavar="FILE", help="Plan to execute; plan.json in the results by default."),
    ] = None,
    out: OutPath = None,
    gains: Annotated[
        str | None, typer.Option("--gains", metavar="NAME", help="Gain set; the plan's own by default.")
    ] = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Map, simulate and record a plan made before."""
    reporter = Reporter(machine=machine, quiet=quiet)

    def command() -> ExitCode:
        task = load_task(scenario, gains)
        folder = _folder(task, out)
        found = read_plan(task, plan or folder.plan, reporter, gains_given=gains is not None)
        return _carry_out(task, found, folder, reporter)

    run_guarded(reporter, command)


@app.command("warm")
def warm_command(scenario: ScenarioPath, quiet: Quiet = False) -> None:
    """Compile all kernels, so that the next command starts at once; `make` does it when it sets up."""
    reporter = Reporter(machine=False, quiet=quiet)

    def command() -> ExitCode:
        warm_up(load_task(scenario, None), reporter)
        return ExitCode.DONE

    run_guarded(reporter, command)


app.command("watch")(watch_command)
app.command("why")(why_command)
app.command("verify")(verify_command)


def _folder(task: Task, out: Path | None) -> ResultFolder:
    return ResultFolder(out if out is not None else Path("out") / task.scenario.name)


def _no_plan(task: Task, answer: str, reason: str, folder: ResultFolder, reporter: Reporter) -> ExitCode:
    reporter.table(task.scenario.name, summary_rows(reporter.facts))
    reporter.say(f"[bold]{answer}[/]: {escape(reason)}")
    if folder.certificate.exists():
        reporter.say(f"The proof is in {escape(str(folder.certificate))}")
    reporter.say(f"What blocks, and what would help: coop-drake why {escape(str(task.scenario.path))}")
    return ExitCode.INFEASIBLE if answer == "infeasible" else ExitCode.UNDECIDED


def _carry_out(task: Task, found: Plan, folder: ResultFolder, reporter: Reporter) -> ExitCode:
    """Simulate a plan and record it; a violated invariant or a goal not reached is a failed run."""
    log = simulate_task(task, found, folder, reporter)
    write_pictures(task, found, log, folder, reporter)
    reporter.table(task.scenario.name, summary_rows(reporter.facts))
    reporter.say(
        f"Results are in {escape(str(folder.path))}; open {escape(str(folder.recording))} in a browser"
    )
    if log.violation:
        reporter.complain(log.violation)
    elif not log.reached:
        reporter.complain(f"the goal was not reached within {log.times[-1]:.1f} s of simulated time")
    return ExitCode.DONE if log.reached and not log.violation else ExitCode.FAILED_RUN
