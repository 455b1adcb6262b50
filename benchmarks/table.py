"""Rows as tables on the screen, one for each topic, and what there is to measure."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from rich.console import Console
from rich.table import Table

from benchmarks.planner.guarantees import guarantee_table
from benchmarks.rows import Row
from benchmarks.tasks import Task

_WIDTH = 130


def show(rows: Sequence[Row], console: Console | None = None) -> None:
    """Print one table per topic, a line for each item, a column for each figure, then one of the planners.

    Behind a figure stands, in brackets, how many times its peer's it is; the peers are named below.

    Args:
        rows: What was measured, in any order.
        console: Where to print.
    """
    screen = console or Console(width=max(_WIDTH, Console().width))
    for topic, members in groupby(sorted(rows, key=lambda row: _place(rows, row)), key=lambda row: row.topic):
        topical = list(members)
        screen.print(f"\n[bold]{topic}[/]", highlight=False)
        screen.print(_table(topical))
        for line in dict.fromkeys(
            f"  {row.item}/{row.figure}: beside {row.peer}"
            + ("" if row.peer_value is None else f", {_number(row.peer_value)} {row.unit}")
            for row in topical
            if row.peer
        ):
            screen.print(line, style="dim", highlight=False)
    planners = guarantee_table(rows)
    if planners is not None:
        screen.print()
        screen.print(planners)


def _place(rows: Sequence[Row], row: Row) -> int:
    return [other.topic for other in rows].index(row.topic)


def _table(rows: Sequence[Row]) -> Table:
    figures = list(dict.fromkeys(row.figure for row in rows))
    table = Table()
    table.add_column("")
    for figure in figures:
        units = {row.unit for row in rows if row.figure == figure}
        unit = f"\n[{units.pop()}]" if len(units) == 1 and figure != "answer" else ""
        table.add_column(figure.replace("_", " ") + unit.replace("[", "\\["), justify="right")
    for item in dict.fromkeys(row.item for row in rows):
        cells = {row.figure: row for row in rows if row.item == item}
        table.add_row(item, *(_cell(cells.get(figure), rows) for figure in figures))
    return table


def _cell(row: Row | None, rows: Sequence[Row]) -> str:
    if row is None:
        return ""
    if row.figure == "answer":
        return row.unit
    shared = len({other.unit for other in rows if other.figure == row.figure}) == 1
    text = _number(row.value) + ("" if shared else f" {row.unit}")
    return text if row.ratio is None else f"{text} (x{row.ratio:.2g})"


def _number(value: float) -> str:
    return f"{value:.3g}" if abs(value) < 1e3 else f"{value:,.0f}"


TOPICS = {
    "planner": "plans and proofs beside OMPL and beside the planner without its parts; growth; teams",
    "starting": "commands from start to end beside the import of all of Drake; their memory",
    "command": "whole commands in processes of their own",
    "mapping": "harmonic maps: accuracy, speed, how both grow",
    "simulating": "the closed loop beside the bare plant; memory of repeated runs",
    "departures": "transports of teams that are not ideal, mild and harsh; with predictor and observer",
    "deployed": "shipped transports under the preset mobile_base, at 10 and 20 ms, beside the ideal ones",
    "compiled": "runs of the compiled loop beside those of Drake's: how many a second, and their differences",
    "alarms": "levels of monitors: 400 certified runs of each shipped transport; the chance of false alarms",
    "smooth": "teams that pass beside the quickest motions found; single stages off; squeezing; three speeds",
    "words": "teams that pass, with a robot deaf or mute: how far they part; cost of their runs",
    "apart": "processes of their own: cost of messages and of 2, 4 and 8 robots; kills; limp robots; stops",
    "adversaries": "altered plans and proofs beside the exact checker; how long it checks random answers",
}
"""What every topic is about."""

WHOLE = "about an hour on two cores, most of it for the planner, the adversaries and random questions"
"""How long everything takes."""


def show_contents(tasks: Sequence[Task]) -> None:
    """Show topics on standard output, with the names that ``--only`` takes, and how to measure them."""
    table = Table("topic", "tasks", "what", "parts, for --only", show_lines=True)
    for topic, about in TOPICS.items():
        names = [task.name.split("/")[1:] for task in tasks if task.name.split("/")[0] == topic]
        if names:
            parts = dict.fromkeys(parts[0] for parts in names)
            table.add_row(topic, str(len(names)), about, ", ".join(parts))
    console = Console(highlight=False)
    console.print(table)
    console.print("A part: python -m benchmarks TOPIC --only PART")
    console.print(f"Everything: python -m benchmarks, {WHOLE}", soft_wrap=True)
    console.print("Rows go to out/bench.json as they come; Ctrl-C keeps them.", soft_wrap=True)
