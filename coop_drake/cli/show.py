"""The command show: a picture of a scenario, or of a plan for it; nothing is searched or simulated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from coop_drake.cli.options import ScenarioPath, out_file
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.simulate import read_plan
from coop_drake.cli.summary import summary_rows
from coop_drake.cli.task import read_task

_PICTURES = (".png", ".svg")

EXAMPLES = (
    ("show models/base.scenario.yaml", "a picture of floor, start and goal"),
    ("show models/base.scenario.yaml --plan out/base/plan.json --out base.svg", "with the plan's channel"),
)


def show_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    plan: Annotated[
        Path | None, typer.Option("--plan", metavar="FILE", help="A plan for it; its cells are drawn too.")
    ] = None,
    out: Annotated[Path | None, out_file("*.png or *.svg; show.png in the results by default.")] = None,
) -> None:
    """Draw the floor, the team at start and goal, and the cells of a plan."""
    if out is not None and out.suffix.lower() not in _PICTURES:
        raise typer.BadParameter(f"{out} ends neither in .png nor in .svg.")
    from coop_drake.drawing import house_style, save_figure
    from coop_drake.viz.figures import overview_figure

    task = read_task(scenario, reporter=reporter)
    found = None if plan is None else read_plan(task, plan, reporter)
    caption = f"{task.name}: start and goal"
    if found is not None:
        caption += f", and the plan's {len(found.cells)} cells for the object's position"
    path = out or ResultFolder.of(task.name, None).path / "show.png"
    with house_style():
        save_figure(overview_figure(task.problem, found, f"{caption}."), path)
    if found is not None:
        reporter.table(task.name, summary_rows(reporter.facts))
    reporter.say(f"The picture is {escape(str(path))}")
