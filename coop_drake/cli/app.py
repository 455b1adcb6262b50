"""The commands and the headings that the help lists them under.

A command is a function in the module of its name: ``coop-drake plan`` is ``plan_command`` in ``plan.py``; one
with commands of its own is a ``Typer``.
It imports Drake, the planner and matplotlib when it is called, so that no command waits for what it does not
need.

A new command is a module here, an entry in ``_PANELS``, its examples in ``examples.py`` (without them the
import fails), and a row in the README.
"""

from __future__ import annotations

import atexit
import json
import os
import sys
from collections.abc import Callable
from io import TextIOWrapper
from typing import Annotated

import typer

from coop_drake.cli.bench import bench_command
from coop_drake.cli.campaign import campaign_app
from coop_drake.cli.compare import compare_command
from coop_drake.cli.diagram import diagram_command
from coop_drake.cli.doctor import doctor_command
from coop_drake.cli.examples import epilog
from coop_drake.cli.floor_plan import floor_plan_command
from coop_drake.cli.kernel_cache import keep_kernels_somewhere
from coop_drake.cli.keys import keys_command
from coop_drake.cli.maps import maps_command
from coop_drake.cli.new import new_command
from coop_drake.cli.object import object_command
from coop_drake.cli.plan import plan_command
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.reproduce import reproduce_command
from coop_drake.cli.robot import robot_command
from coop_drake.cli.robot_node import robot_node_command
from coop_drake.cli.run import run_command
from coop_drake.cli.schema import schema_command
from coop_drake.cli.show import show_command
from coop_drake.cli.simulate import simulate_command
from coop_drake.cli.supervisor import supervisor_command
from coop_drake.cli.tune import tune_command
from coop_drake.cli.verify import verify_command
from coop_drake.cli.warm import warm_command
from coop_drake.cli.watch import watch_command
from coop_drake.cli.why import why_command
from coop_drake.cli.world import world_command

_PANELS: dict[str, dict[str, Callable[..., None] | typer.Typer]] = {
    "Carrying objects": {
        "run": run_command,
        "plan": plan_command,
        "simulate": simulate_command,
        "tune": tune_command,
        "compare": compare_command,
        "campaign": campaign_app,
    },
    "A case of your own": {
        "new": new_command,
        "floor-plan": floor_plan_command,
        "robot": robot_command,
        "object": object_command,
        "show": show_command,
        "schema": schema_command,
    },
    "Processes of their own": {
        "world": world_command,
        "robot-node": robot_node_command,
        "supervisor": supervisor_command,
        "keys": keys_command,
    },
    "Understanding answers": {
        "why": why_command,
        "verify": verify_command,
        "watch": watch_command,
        "diagram": diagram_command,
        "reproduce": reproduce_command,
    },
    "This machine": {
        "doctor": doctor_command,
        "warm": warm_command,
        "maps": maps_command,
        "bench": bench_command,
    },
}
"""Every command by its name, under the headings of the help and in its order."""

_PASSES_ARGUMENTS_ON = {"bench": {"allow_extra_args": True, "ignore_unknown_options": True}}
"""Settings of commands that hand their arguments to another program."""

_UsageError = typer.BadParameter.__base__  # The same base in typer's own click and in the package click.

app = typer.Typer(
    name="coop-drake",
    help="Plan, map, control and simulate several mobile manipulators that carry one object.",
    epilog="Begin with `coop-drake run base`, and for a case of your own with `coop-drake new NAME`.\n\n"
    "Exit codes: 0 done, 1 failed run, 2 bad input, 3 infeasible, 4 undecided, "
    "5 beyond limits, 130 interrupted.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
)


def main() -> None:
    """Run the command line; wrong usage is answered like any bad input."""
    arguments = sys.argv[1:]
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # A terminal in ASCII shows ? for what it does not have.
            stream.reconfigure(errors="replace")
    keep_kernels_somewhere()
    try:
        code = app(arguments, standalone_mode=False)
        if code == ExitCode.INTERRUPTED and not Reporter.complained:  # before or after the command itself
            raise KeyboardInterrupt
    except _UsageError as error:  # type: ignore[misc]
        error.show()
        if "--json" in arguments:
            sys.stdout.write(json.dumps({"error": error.format_message()}) + "\n")
        code = ExitCode.BAD_INPUT
    # All files are closed. To take down Drake and LLVM object by object would cost 0.4 s of every command.
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(int(code or 0))


@app.callback(invoke_without_command=True)
def show_version(
    show: Annotated[bool, typer.Option("--version", help="Show the version.", is_eager=True)] = False,
) -> None:
    """Answer ``--version``."""
    if show:
        from importlib.metadata import version

        typer.echo(f"coop_drake {version('coop-drake')}")
        raise typer.Exit


for panel, commands in _PANELS.items():
    for name, command in commands.items():
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name, epilog=epilog(name), rich_help_panel=panel)
            continue
        settings = _PASSES_ARGUMENTS_ON.get(name)
        app.command(name, epilog=epilog(name), rich_help_panel=panel, context_settings=settings)(command)
