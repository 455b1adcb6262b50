"""The commands, the headings that the help lists them under, and what commands of before are called now.

A command is a function in the module of its name, which is given a reporter: ``coop-drake plan`` is
``plan_command`` in ``plan.py``; one with commands below it is a ``Typer``. The module lists examples of it in
``EXAMPLES``, which its help shows. It imports Drake, the planner and matplotlib when it is called, so that no
command waits for what it does not need.

A new command is a module here, an entry in ``_PANELS``, and a row in the README; a new option is an argument
of its function.
"""

from __future__ import annotations

import atexit
import json
import os
import sys
from io import TextIOWrapper
from types import ModuleType
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from coop_drake.cli import (
    apart,
    campaign,
    diagram,
    doctor,
    floor_plan,
    new,
    plan,
    reproduce,
    robot,
    run,
    show,
    simulate,
    tune,
    verify,
    watch,
    why,
)
from coop_drake.cli.options import TableOptions, command
from coop_drake.cli.reporter import ExitCode, Reporter, UsageError

_PANELS: dict[str, tuple[ModuleType, ...]] = {
    "Carrying objects": (run, plan, simulate, tune, campaign, apart),
    "A case of your own": (new, floor_plan, robot, show),
    "Understanding answers": (why, verify, watch, diagram, reproduce),
    "This machine": (doctor,),
}
"""The modules of all commands, under the headings of the help and in its order."""

_OUTPUTS = dict.fromkeys((run, plan, simulate), (TableOptions,))
"""Commands whose closing table may have more rows."""

_OLD_NAMES: dict[tuple[str, str], str] = {
    ("keys", ""): "is now `coop-drake apart keys`",
    ("world", ""): "is now `coop-drake apart world`",
    ("supervisor", ""): "is now `coop-drake apart supervisor`",
    ("robot-node", ""): "is now `coop-drake apart robot`",
    ("warm", ""): "is now `coop-drake doctor --warm`",
    ("maps", "--clear"): "is now `coop-drake doctor --clear-maps`",
    ("maps", ""): "is now `coop-drake doctor --maps`",
    ("object", ""): "is now `coop-drake new object`",
    ("schema", ""): "is now the file models/scenario.schema.json",
    ("bench", ""): "is now `python -m benchmarks`, in a clone of the repository",
    ("compare", ""): "is gone: a scenario with `plant: {grasps: constraints}` simulates such grasps",
    ("plan", "--workers"): "is gone: a plan is made in one process",
    ("run", "--workers"): "is gone: a plan is made in one process",
    ("run", "--blocks"): "is gone: every robot has blocks of its own",
    ("simulate", "--blocks"): "is gone: every robot has blocks of its own",
    ("campaign", "question"): "is now `python -m benchmarks question`, in a clone of the repository",
}
"""Commands of before, each alone or with an option or a command below it, and what takes their place."""


class _Commands(TyperGroup):
    """Refuses commands and options of before by their new names."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Look for old names among the arguments, options cut at their ``=``."""
        words = [word.partition("=")[0] for word in args]
        for (name, part), now in () if ctx.resilient_parsing else _OLD_NAMES.items():
            if words[:1] == [name] and (not part or part in words[1:]):
                raise UsageError(f"`{' '.join(filter(None, (name, part)))}` {now}.", ctx)
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_Commands,
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
    try:
        code = app(arguments, standalone_mode=False)
        if code == ExitCode.INTERRUPTED and not Reporter.complained:  # before or after the command itself
            raise KeyboardInterrupt
    except UsageError as error:
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


def _epilog(module: ModuleType) -> str:
    """Return the examples of a command as text for the end of its help; blank lines keep them apart."""
    lines = [f"coop-drake {line}  [dim]{what}[/]" for line, what in module.EXAMPLES]
    return "\n\n".join(["[bold]Examples[/]", *lines])


for _panel, _modules in _PANELS.items():
    for _module in _modules:
        _word = _module.__name__.rpartition(".")[2]
        _said: dict[str, Any] = {"name": _word.replace("_", "-"), "epilog": _epilog(_module)}
        if _group := getattr(_module, f"{_word}_app", None):
            app.add_typer(_group, **_said, rich_help_panel=_panel)
        else:
            _made = command(getattr(_module, f"{_word}_command"), *_OUTPUTS.get(_module, ()))
            app.command(**_said, rich_help_panel=_panel)(_made)
