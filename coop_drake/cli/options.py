"""Commands from functions, arguments that several of them have, and what a shell offers for these."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperGroup

from coop_drake.apart import REJOIN, RESTARTS
from coop_drake.cli.reporter import reporting
from coop_drake.shipped import scenario_file, shipped_scenarios

_ENDING = ".scenario.yaml"
_SHIPPED_GAINS = ("scheduled", "table_2")


class FirstByDefault(TyperGroup):
    """Takes its first command where none is named: ``campaign FILE`` for ``campaign run FILE``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put the first command before arguments that begin with no command."""
        if args and args[0] not in self.commands and args[0] != "--help":
            args = [next(iter(self.commands)), *args]
        return super().parse_args(ctx, args)


def out_folder(meaning: str) -> Any:
    """The option ``--out`` for a folder."""
    return typer.Option("--out", metavar="DIR", file_okay=False, help=meaning)


def out_file(meaning: str) -> Any:
    """The option ``--out`` for a file."""
    return typer.Option("--out", metavar="FILE", dir_okay=False, help=meaning)


def complete_scenario(incomplete: str) -> list[str]:
    """Shipped scenarios, scenario files, and folders on the way to some, that begin as typed."""
    typed = Path(incomplete)
    folder = typed if incomplete.endswith("/") else typed.parent
    shipped = [name for name in shipped_scenarios() if name.startswith(incomplete)]
    if not folder.is_dir():
        return shipped
    entries = sorted(folder.iterdir())
    names = [f"{entry}/" if entry.is_dir() else str(entry) for entry in entries]
    found = [name for name in names if name.endswith(("/", _ENDING)) and name.startswith(incomplete)]
    return shipped + [name for name in found if not name.rstrip("/").rpartition("/")[2].startswith(".")]


def complete_gains(context: typer.Context, incomplete: str) -> list[str]:
    """Names of the scenario's gain sets that begin as typed."""
    names = set(_SHIPPED_GAINS)
    scenario = context.params.get("scenario")
    if scenario is not None:
        names |= _gain_sets(scenario_file(scenario))
    return sorted(name for name in names if name.startswith(incomplete))


def _gain_sets(path: Path) -> set[str]:
    """Names as they stand in the file; a file that cannot be read offers none."""
    from coop_drake.scenario.document import parse

    try:
        content: Any = parse(path.read_text(encoding="utf-8"))
        return {str(name) for name in content["gains"]["sets"]}
    except (OSError, ValueError, KeyError, TypeError):
        return set()


ScenarioPath = Annotated[
    Path,
    typer.Argument(
        metavar="SCENARIO",
        help="Scenario file (*.scenario.yaml), a folder with one, or the name of a shipped scenario.",
        autocompletion=complete_scenario,
    ),
]
GainsName = Annotated[
    str | None,
    typer.Option(
        "--gains",
        metavar="NAME|FILE",
        help="Rest in every cell with this gain set, by name or from a file as `tune` writes it; by default "
        "what the scenario selects, or else pass from cell to cell without a stop.",
        autocompletion=complete_gains,
    ),
]
BudgetName = Annotated[
    str | None,
    typer.Option(
        "--budget",
        metavar="all|position|FILE",
        help="What the plan must tolerate: `all` of the scenario's `deployment`, `position` for the object's "
        "position alone, or a file with a budget.",
    ),
]
Effort = Annotated[
    float | None,
    typer.Option(
        "--effort",
        metavar="SHARE",
        min=0.0,
        max=1000.0,
        help="How much work to spend on a quicker transport: 0 takes the first path that is found, 2 doubles "
        "the work. By default the scenario's `planner: {effort}`.",
    ),
]
ResultsFolder = Annotated[Path | None, out_folder("Where results go; out/<scenario> by default.")]
PictureFolder = Annotated[Path | None, out_folder("Where the picture goes; out/<scenario> by default.")]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Write the recording, but no figures.")]
FreeRunning = Annotated[
    bool,
    typer.Option(
        "--free-running",
        help="Run at the pace of the wall clock, do not wait for late efforts, and print how old they were.",
    ),
]
FaultsFile = Annotated[
    Path | None,
    typer.Option(
        "--faults",
        metavar="FILE",
        help="YAML file of faults between processes: lost, late or repeated messages, and wrong clocks.",
    ),
]
Rejoin = Annotated[
    float,
    typer.Option(
        "--rejoin",
        metavar="SECONDS",
        min=0.0,
        help="How long the team waits at rest for a process that does not answer, before the run ends.",
    ),
]


@dataclass(frozen=True)
class RunOptions:
    """Options of the commands that carry out a plan: what is shown, and what is kept."""

    fresh_maps: Annotated[
        bool,
        typer.Option(
            "--fresh-maps", help="Solve all maps anew; others come from the cache, see `doctor --maps`."
        ),
    ] = False
    live: Annotated[
        bool,
        typer.Option("--live", help="Show the run in a browser while it is simulated, at most in real time."),
    ] = False
    wait: Annotated[
        bool, typer.Option("--wait", help="Like --live, but begin only when a browser shows the page.")
    ] = False
    no_figures: NoFigures = False


@dataclass(frozen=True)
class ApartOptions:
    """Options of the commands that start a team whose robots are processes of their own."""

    apart: Annotated[
        bool,
        typer.Option(
            "--apart",
            help="Run every robot and the supervisor as a process of its own; same results, bit for bit. "
            "Needs `deployment: {control_rate}`.",
        ),
    ] = False
    restarts: Annotated[
        int,
        typer.Option(
            "--restarts",
            metavar="N",
            min=0,
            help="With --apart: how often a process that ends too early is started again.",
        ),
    ] = RESTARTS
    rejoin: Rejoin = REJOIN
    faults: FaultsFile = None
    free_running: FreeRunning = False


@dataclass(frozen=True)
class OutputOptions:
    """Options of every command: for whom it reports."""

    machine: Annotated[
        bool, typer.Option("--json", help="One JSON object on standard output, all else on standard error.")
    ] = False
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show errors only.")] = False


@dataclass(frozen=True)
class TableOptions(OutputOptions):
    """Those, and how much a closing table shows."""

    verbose: Annotated[
        bool,
        typer.Option("--verbose", "-v", help="Show more rows in the closing table; --json has all facts."),
    ] = False


def command(function: Callable[..., None], output: type[OutputOptions] = OutputOptions) -> Any:
    """Make a command of a function whose first argument is a reporter.

    The command has the options of ``output``, by which it makes the reporter, and in place of an argument
    whose type is a dataclass an option for each of its fields.
    """
    _, *own = inspect.signature(function).parameters.values()
    hints: dict[str, Any] = get_type_hints(function, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    listed: list[inspect.Parameter] = []
    for one in own:
        if one.name in groups:
            listed += _options(groups[one.name])
        else:
            listed.append(one.replace(kind=one.KEYWORD_ONLY, annotation=hints[one.name]))
    listed += _options(output)

    @wraps(function)
    def called(**values: Any) -> None:
        def made(kind: Any) -> Any:
            return kind(**{field.name: values.pop(field.name) for field in fields(kind)})

        arguments = {name: made(kind) for name, kind in groups.items()}
        with reporting(**vars(made(output))) as reporter:
            function(reporter, **values, **arguments)

    made_command: Any = called
    made_command.__signature__ = inspect.Signature(listed)
    made_command.__annotations__ = {one.name: one.annotation for one in listed}
    return made_command


def _options(group: Any) -> list[inspect.Parameter]:
    """Return a parameter for every field of a dataclass of options."""
    hints, keyword = get_type_hints(group, include_extras=True), inspect.Parameter.KEYWORD_ONLY
    return [
        inspect.Parameter(one.name, keyword, default=one.default, annotation=hints[one.name])
        for one in fields(group)
    ]
