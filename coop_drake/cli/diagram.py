"""The command diagram: draws how the closed loop is wired."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import PictureFolder, ScenarioPath
from coop_drake.cli.plan import plan_of
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.task import map_cells, read_task

EXAMPLES = (
    ("diagram models/base.scenario.yaml --robot 1", "the blocks of the loop and of the second robot"),
)


def diagram_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    robot: Annotated[
        int, typer.Option("--robot", metavar="K", min=0, help="Whose controller is opened.")
    ] = 0,
    out: PictureFolder = None,
) -> None:
    """Draw the blocks of the closed loop and of one robot's controller, as they are wired in Drake."""
    from coop_drake.diagram import build_closed_loop
    from coop_drake.drawing import save_figure
    from coop_drake.errors import ScenarioError
    from coop_drake.scenario import assemble
    from coop_drake.viz.block_diagram import block_diagram_figure

    task = read_task(scenario, reporter=reporter)
    robots = assemble(task.scenario).robots
    if robot >= len(robots):
        raise ScenarioError(str(scenario), "--robot", robot, f"a number from 0 to {len(robots) - 1}")
    # An earlier run's results stay as they are: only the picture is written.
    folder = ResultFolder.of(task.name, out, "diagram")
    plan = plan_of(task, None, reporter)
    if plan is None:
        return
    loop = build_closed_loop(task.scenario, plan, map_cells(task, plan, reporter))
    folder.begin("diagram")
    picture = folder.path / "diagram.svg"
    with reporter.stage("drawing"):
        save_figure(block_diagram_figure(loop, robot), picture)
    reporter.say(f"The picture is in {escape(str(picture))}")
