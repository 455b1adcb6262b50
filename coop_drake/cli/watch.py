"""The command watch: records a search, and draws it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.markup import escape

from coop_drake.cli.options import ScenarioPath
from coop_drake.cli.plan import plan_of
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import summary_rows
from coop_drake.cli.task import read_task

_FEWEST, _MOST = 2, 500
"""Numbers of keyframes that make a moving picture and still fit into a page that browsers open [-]."""

EXAMPLES = (("watch models/base.scenario.yaml", "pictures and a page of the search in out/base/think/"),)


def watch_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    out: Annotated[
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
            help="Largest number of keyframes.",
        ),
    ] = 36,
    strategy: Annotated[
        Literal["cells", "paper", "portfolio"],
        typer.Option(
            "--strategy",
            help="Exploration by cells, the paper's exploration, or (portfolio) the whole search of `plan`.",
        ),
    ] = "cells",
) -> None:
    """Watch the planner search: pictures, a moving picture and a page to turn in space."""
    from coop_drake import watching

    task = read_task(scenario, reporter=reporter)
    folder = ResultFolder.of(task.name, out, "search", below="think")
    with reporter.stage("searching") as progress:
        recording = watching.record_search(task.problem, strategy, progress)
        shown = watching.keyframes(recording, frames)
    reporter.facts.update(
        answer=recording.verdict.value,
        slices=shown[-1].state.slices,
        events=len(recording.events),
        frames=len(shown),
    )
    folder.begin("search")
    with reporter.stage("drawing") as progress:
        written = watching.write_pictures(recording, shown, folder.path, progress)
    written.append(watching.write_scene(recording, shown, folder.path / "think.html"))
    reporter.facts["bytes"] = {path.name: path.stat().st_size for path in written}
    reporter.say(f"[bold]{escape(shown[-1].headline)}[/]")
    place, page = escape(str(folder.path)), escape(str(written[-1]))
    reporter.say(f"{len(shown)} pictures are in {place}; open {page} in a browser")
    reporter.code = ExitCode.of(recording.verdict.value)
    if reporter.code is not ExitCode.DONE:
        return
    if strategy != "portfolio":  # A search that was watched alone has other cells than the plan.
        reporter.say("These cells are of this search alone; the plan is made of others: --strategy portfolio")
    elif plan_of(task, None, reporter):
        reporter.table(task.name, summary_rows(reporter.facts))
