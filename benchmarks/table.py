"""Rows as tables on the screen, one for each topic."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from rich.console import Console
from rich.table import Table

from benchmarks.planner.guarantees import guarantee_table
from benchmarks.rows import Row

__all__ = ["show"]

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
