"""The command watch: records a search, and draws it."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.markup import escape

from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.guard import reporting
from coop_drake.cli.options import Machine, Quiet, ScenarioPath
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.task import read_task

if TYPE_CHECKING:
    from coop_drake.answers import PlanningProblem

_FEWEST, _MOST = 2, 500
"""Numbers of keyframes that make a moving picture and still fit into a page that browsers open [-]."""
_OURS = ("think_[0-9][0-9][0-9][0-9].png", "think.png", "think.gif", "think.html")
"""Files of an older recording, which are removed before a new one is written."""


def _checked_margin(value: float | None) -> float | None:
    if value is not None and not isfinite(value):
        raise typer.BadParameter(f"{value} is not a length in metres.")
    return value


def watch_command(
    scenario: ScenarioPath,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "--out",
            metavar="DIR",
            file_okay=False,
            help="Where pictures go; out/<scenario>/think by default.",
        ),
    ] = None,
    frames: Annotated[
        int,
        typer.Option(
            "--frames",
            metavar="N",
            min=_FEWEST,
            max=_MOST,
            help="Largest number of keyframes; 36 by default.",
        ),
    ] = 36,
    strategy: Annotated[
        Literal["cells", "paper", "portfolio"],
        typer.Option("--strategy", help="Exploration by cells, as the paper prints it, or all of planning."),
    ] = "cells",
    margin: Annotated[
        float | None,
        typer.Option(
            "--margin",
            metavar="M",
            min=0.0,
            callback=_checked_margin,
            help="Metres to keep from the walls; cells: 0 by default, else 'no path' is no proof.",
        ),
    ] = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Watch the planner search: pictures, a moving picture and a page to turn in space."""
    with reporting(machine=machine, quiet=quiet) as reporter:
        task = read_task(scenario)
        directory = ResultFolder.of(task.name, output, "think").path
        reporter.code = _watch(task.problem, directory, frames, strategy, margin, reporter)


def _watch(
    problem: PlanningProblem,
    directory: Path,
    frames: int,
    strategy: str,
    margin: float | None,
    reporter: Reporter,
) -> ExitCode:
    """Record, then draw."""
    from coop_drake import watching

    chosen = watching.Strategy(strategy)
    if margin is None:
        margin = problem.settings.margin if chosen is watching.Strategy.PORTFOLIO else 0.0
    with reporter.stage("searching") as progress:
        recording = watching.record_search(problem, chosen, margin, progress)
        shown = watching.keyframes(recording, frames)
    reporter.facts.update(
        answer=recording.verdict.value,
        slices=shown[-1].state.slices,
        events=len(recording.events),
        frames=len(shown),
    )
    _forget(directory)
    with reporter.stage("drawing") as progress:
        written = watching.write_pictures(recording, shown, directory, progress)
    with reporter.stage("scene") as progress:
        written.append(watching.write_scene(recording, shown, directory / "think.html", progress))
    reporter.facts["bytes"] = {path.name: path.stat().st_size for path in written}
    reporter.say(f"[bold]{escape(shown[-1].headline)}[/]")
    reporter.say(
        f"{len(shown)} pictures are in {escape(str(directory))}; open {escape(str(written[-1]))} in a browser"
    )
    return _code(recording.verdict.value, recording.margin)


def _forget(directory: Path) -> None:
    """Remove an older recording, so that the folder never mixes two."""
    for pattern in _OURS:
        for path in directory.glob(pattern):
            path.unlink()


def _code(verdict: str, margin: float) -> ExitCode:
    """Return the exit code: that no path keeps a margin proves nothing about the scenario itself."""
    if verdict == "found":
        return ExitCode.DONE
    return ExitCode.INFEASIBLE if verdict == "infeasible" and margin == 0.0 else ExitCode.UNDECIDED
