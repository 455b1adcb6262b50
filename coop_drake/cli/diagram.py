"""The command diagram: draws how the closed loop is wired."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.exit_code import ExitCode
from coop_drake.cli.guard import run_guarded
from coop_drake.cli.options import PictureFolder, Quiet, ScenarioPath
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder

__all__ = ["diagram_command"]


def diagram_command(
    scenario: ScenarioPath,
    robot: Annotated[
        int, typer.Option("--robot", metavar="K", min=0, help="Whose controller is opened.")
    ] = 0,
    out: PictureFolder = None,
    quiet: Quiet = False,
) -> None:
    """Draw the blocks of the closed loop and of one robot's controller, as they are wired in Drake."""
    reporter = Reporter(machine=False, quiet=quiet)
    run_guarded(reporter, lambda: _draw(scenario, robot, out, reporter))


def _draw(scenario: Path, robot: int, out: Path | None, reporter: Reporter) -> ExitCode:
    # Here and not above: no other command should wait for Drake or for the pictures' library.
    from coop_drake.answers import Found
    from coop_drake.cli.mapping import map_cells
    from coop_drake.cli.planning import search_plan, without_plan
    from coop_drake.cli.reading import read_task
    from coop_drake.diagram import build_closed_loop
    from coop_drake.drawing import save_figure
    from coop_drake.errors import ScenarioError
    from coop_drake.scenario import assemble
    from coop_drake.viz.block_diagram import block_diagram_figure

    task = read_task(scenario, None)
    robots = assemble(task.scenario).robots
    if robot >= len(robots):
        raise ScenarioError(str(scenario), "--robot", robot, f"a number from 0 to {len(robots) - 1}")
    # An earlier run's results stay as they are: only the picture is written.
    result = search_plan(task.question, reporter)
    if not isinstance(result, Found):
        return without_plan(task.question, result, None, reporter)
    loop = build_closed_loop(task.scenario, result.plan, map_cells(task, result.plan, reporter, fresh=False))
    picture = ResultFolder.of(task.scenario.name, out).diagram
    with reporter.stage("drawing"):
        save_figure(block_diagram_figure(loop, robot), picture)
    reporter.say(f"The picture is {escape(str(picture))}")
    return ExitCode.DONE
