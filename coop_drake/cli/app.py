"""The commands, under the headings of the help; run, plan, simulate and warm are here themselves.

Every command brings in what it needs when it is called: some need Drake, some the planner, some pictures,
and none should wait for, or keep in memory, what only another one needs.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Literal

import typer

from coop_drake.cli.bench import bench_command
from coop_drake.cli.compare import compare_command
from coop_drake.cli.diagram import diagram_command
from coop_drake.cli.doctor import doctor_command
from coop_drake.cli.examples import epilog
from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.floor_plan import floor_plan_command
from coop_drake.cli.guard import run_guarded
from coop_drake.cli.kernel_cache import keep_kernels_somewhere
from coop_drake.cli.map_cache import maps_command
from coop_drake.cli.new import new_command
from coop_drake.cli.options import GainsName, Machine, Quiet, ResultsFolder, ScenarioPath
from coop_drake.cli.question import read_apart
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.reproduce import reproduce_command
from coop_drake.cli.robot import robot_command
from coop_drake.cli.schema import schema_command
from coop_drake.cli.show import show_command
from coop_drake.cli.tune import tune_command
from coop_drake.cli.verify import verify_command
from coop_drake.cli.watch import watch_command
from coop_drake.cli.why import why_command

__all__ = ["app", "main"]

_UsageError = typer.BadParameter.__base__  # The same base in typer's own click and in the package click.

_CARRYING, _MACHINE = "Carrying objects", "This machine"
"""Headings of the help."""

app = typer.Typer(
    name="coop-drake",
    help="Plan, map, control and simulate several mobile manipulators that carry one object.",
    epilog="Begin with `coop-drake run base`, and for a case of your own with `coop-drake new NAME`.\n\n"
    "Exit codes: 0 done, 1 failed run, 2 bad input, 3 infeasible, 4 undecided, 130 interrupted.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)

FreshMaps = Annotated[
    bool, typer.Option("--fresh-maps", help="Solve all maps anew; others come from the cache, see `maps`.")
]
Live = Annotated[
    bool,
    typer.Option("--live", help="Show the run in a browser while it is simulated, at most in real time."),
]
BlocksName = Annotated[
    Literal["named", "fused"],
    typer.Option("--blocks", help="Blocks of every robot, or, for speed, one for the team: equal results."),
]


def main() -> None:
    """Run the command line; wrong usage is answered like any bad input."""
    arguments = sys.argv[1:]
    keep_kernels_somewhere()
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


@app.command("run", epilog=epilog("run"), rich_help_panel=_CARRYING)
def run_command(
    scenario: ScenarioPath,
    out: ResultsFolder = None,
    gains: GainsName = None,
    fresh_maps: FreshMaps = False,
    live: Live = False,
    blocks: BlocksName = "named",
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Plan, map, simulate and record a transport."""
    reporter = Reporter(machine=machine, quiet=quiet)

    def command() -> ExitCode:
        from coop_drake.cli.simulating import run_scenario

        return run_scenario(scenario, gains, out, reporter, fresh_maps=fresh_maps, live=live, blocks=blocks)

    run_guarded(reporter, command)


@app.command("plan", epilog=epilog("plan"), rich_help_panel=_CARRYING)
def plan_command(
    scenario: ScenarioPath,
    out: ResultsFolder = None,
    gains: GainsName = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Plan only: write the plan, or say why there is none."""
    reporter = Reporter(machine=machine, quiet=quiet)

    def command() -> ExitCode:
        # Drake is never in this process; the planner is brought in while the other one reads.
        question = read_apart(scenario, gains, lambda: import_module("coop_drake.cli.planning"))
        from coop_drake.cli.planning import plan_only

        return plan_only(question, out, reporter)

    run_guarded(reporter, command)


@app.command("simulate", epilog=epilog("simulate"), rich_help_panel=_CARRYING)
def simulate_command(
    scenario: ScenarioPath,
    plan: Annotated[
        Path | None,
        typer.Option("--plan", metavar="FILE", help="Plan to execute; plan.json in the results by default."),
    ] = None,
    out: ResultsFolder = None,
    gains: Annotated[
        str | None,
        typer.Option("--gains", metavar="NAME|FILE", help="Gain set or its file; the plan's own by default."),
    ] = None,
    fresh_maps: FreshMaps = False,
    live: Live = False,
    blocks: BlocksName = "named",
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Map, simulate and record a plan made before."""
    reporter = Reporter(machine=machine, quiet=quiet)

    def command() -> ExitCode:
        from coop_drake.cli.simulating import simulate_scenario

        return simulate_scenario(
            scenario, gains, plan, out, reporter, fresh_maps=fresh_maps, live=live, blocks=blocks
        )

    run_guarded(reporter, command)


def warm_command(scenario: ScenarioPath, quiet: Quiet = False) -> None:
    """Compile all kernels, so that the next command starts at once; `make` does it when it sets up."""
    reporter = Reporter(machine=False, quiet=quiet)

    def command() -> ExitCode:
        from coop_drake.cli.warming import warm_up

        return warm_up(scenario, reporter)

    run_guarded(reporter, command)


_PANELS: dict[str, dict[str, Callable[..., None]]] = {
    _CARRYING: {"tune": tune_command, "compare": compare_command},
    "A case of your own": {
        "new": new_command,
        "floor-plan": floor_plan_command,
        "robot": robot_command,
        "show": show_command,
        "schema": schema_command,
    },
    "Understanding answers": {
        "why": why_command,
        "verify": verify_command,
        "watch": watch_command,
        "diagram": diagram_command,
        "reproduce": reproduce_command,
    },
    _MACHINE: {"doctor": doctor_command, "warm": warm_command, "maps": maps_command},
}
"""Commands that need no more than their name, in the order of the help."""

for panel, commands in _PANELS.items():
    for name, command in commands.items():
        app.command(name, epilog=epilog(name), rich_help_panel=panel)(command)
app.command(
    "bench",
    epilog=epilog("bench"),
    rich_help_panel=_MACHINE,
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
)(bench_command)
