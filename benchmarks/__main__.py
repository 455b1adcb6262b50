"""``python -m benchmarks``: measures everything, writes out/bench.json and shows a table."""

from __future__ import annotations

import json
import logging
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.mapping import bench_mapping
from benchmarks.planning import bench_planning
from benchmarks.rows import Row
from benchmarks.simulating import bench_simulation
from coop_drake.files import write_atomically

_RESULTS = Path("out/bench.json")
_WIDTH = 130  # Wide enough for every row on one line.


def main() -> None:
    """Measure, write, show."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    rows, scenario, plan = bench_planning()
    map_rows, maps = bench_mapping(plan)
    rows += map_rows + bench_simulation(scenario, plan, maps)
    write_atomically(_RESULTS, json.dumps([row.as_dict() for row in rows], indent=2).encode() + b"\n")
    _show(rows)


def _show(rows: list[Row]) -> None:
    table = Table(title=str(_RESULTS), title_justify="left")
    for column in ("what", "value", "unit", "peer", "peer's value", "ratio"):
        table.add_column(
            column, justify="left" if column in ("what", "unit", "peer") else "right", no_wrap=True
        )
    for row in rows:
        peer_value, ratio = (
            "" if figure is None else f"{figure:.3g}" for figure in (row.peer_value, row.ratio)
        )
        table.add_row(row.name, f"{row.value:.3g}", row.unit, row.peer, peer_value, ratio)
    Console(width=max(_WIDTH, Console().width)).print(table)


if __name__ == "__main__":
    main()
