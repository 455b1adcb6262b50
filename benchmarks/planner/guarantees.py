"""Planners side by side: the time until a path is known, and what is guaranteed about it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rich.table import Table

from benchmarks.rows import Row


class _Planner(NamedTuple):
    """A planner: its name, where its rows stand below ``planner``, the figure that counts, the guarantee."""

    name: str
    place: str
    figure: str
    guarantee: str


_PLANNERS = (
    _Planner(
        "ours, first plan",
        "",
        "first_plan_cpu_seconds",
        "every configuration of every cell is free, proved in exact arithmetic; without a way, a proof",
    ),
    _Planner(
        "compiled RRT-Connect",
        "rrt_connect/",
        "cpu_seconds",
        "configurations of the path at most 3 cm apart are free; without a way, no answer",
    ),
    _Planner("OMPL RRT-Connect", "ompl/", "cpu_seconds", "the same"),
    _Planner(
        "Drake GCS and IRIS",
        "gcs/",
        "cpu_seconds",
        "of each region at most 1 % collides, with a confidence of 95 %; without a way, no answer",
    ),
)


def guarantee_table(rows: Sequence[Row]) -> Table | None:
    """A line for each planner: CPU time on every scene, how often it found a path, and what it guarantees.

    Args:
        rows: What was measured.

    Returns:
        The table, None where fewer than two planners were measured on one scene.
    """
    figures = {row.name: row for row in rows}
    heads = [f"planner/{planner.place}" for planner in _PLANNERS]
    scenes = list(
        dict.fromkeys(
            row.item
            for row in rows
            if row.name == f"planner/{row.item}/first_plan_cpu_seconds"
            and any(f"{head}{row.item}/found" in figures for head in heads)
        )
    )
    if not scenes:
        return None
    table = Table("planner", title="CPU seconds until a path is known, and what is guaranteed about it")
    for scene in scenes:
        table.add_column(scene, justify="right")
    table.add_column("guaranteed", max_width=44)
    for planner, head in zip(_PLANNERS, heads, strict=True):
        cells = [_cell(figures, f"{head}{scene}/", planner.figure) for scene in scenes]
        if any(cells):
            table.add_row(planner.name, *cells, planner.guarantee)
    return table


def _cell(figures: dict[str, Row], place: str, figure: str) -> str:
    seconds, found = figures.get(place + figure), figures.get(f"{place}found")
    if found is None:
        return "" if seconds is None else f"{seconds.value:.2g}"
    count = f"{found.value:g} {found.unit.partition(' within ')[0]}"
    return f"– ({count})" if seconds is None else f"{seconds.value:.2g} ({count})"
