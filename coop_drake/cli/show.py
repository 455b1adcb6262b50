"""The command show: a picture of a scenario, or of a plan in it; nothing is searched or simulated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.guard import run_guarded
from coop_drake.cli.options import Quiet, ScenarioPath
from coop_drake.cli.question import read_apart
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder

__all__ = ["show_command"]

_PICTURES = (".png", ".svg")


def show_command(
    scenario: ScenarioPath,
    plan: Annotated[
        Path | None, typer.Option("--plan", metavar="FILE", help="A plan for it; its channel is drawn too.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FILE",
            dir_okay=False,
            help="*.png or *.svg; show.png in the results by default.",
        ),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Draw the floor, the team at start and goal, and the channel of a plan."""
    if out is not None and out.suffix.lower() not in _PICTURES:
        raise typer.BadParameter(f"{out} ends neither in .png nor in .svg.")
    reporter = Reporter(machine=False, quiet=quiet)
    run_guarded(reporter, lambda: _show(scenario, plan, out, reporter))


def _show(scenario: Path, plan: Path | None, out: Path | None, reporter: Reporter) -> ExitCode:
    question = read_apart(scenario)
    # Here and not above: no other command should wait for the pictures' library.
    from coop_drake.cli.planning import read_plan
    from coop_drake.drawing import house_style, save_figure
    from coop_drake.viz.floor_figures import overview_figure

    found = None if plan is None else read_plan(question, plan, reporter, gains_given=False)
    caption = f"{question.name}: start and goal"
    if found is not None:
        caption += f", and a channel of {len(found.cells)} cells for the object's position"
    path = out or ResultFolder.of(question.name, None).path / "show.png"
    with house_style():
        save_figure(overview_figure(question.problem, found, f"{caption}."), path)
    reporter.say(f"The picture is {escape(str(path))}")
    return ExitCode.DONE
