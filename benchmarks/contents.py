"""What there is to measure, as a table."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from benchmarks.tasks import Task

__all__ = ["TOPICS", "WHOLE", "show_contents"]

TOPICS = {
    "planner": "plans and proofs beside OMPL and beside the planner without its parts; growth; teams",
    "starting": "commands from start to end beside the import of all of Drake; their memory",
    "command": "whole commands in processes of their own",
    "mapping": "harmonic maps: accuracy, speed, how both grow",
    "simulating": "the closed loop beside the bare plant; memory of repeated runs",
    "departures": "transports of teams that are not ideal, mild and harsh; with predictor and observer",
    "deployed": "shipped transports under the preset mobile_base, at 10 and 20 ms, beside the ideal ones",
    "compiled": "runs of the compiled loop beside those of Drake's: how many a second, and their differences",
    "breaking": "departures that an axis bears, by a search for the worst, beside those that are certified",
    "alarms": "levels of monitors: 400 certified runs of each shipped transport; the chance of false alarms",
    "apart": "processes of their own: cost of messages and of 2, 4 and 8 robots; kills; limp robots; stops",
    "campaign": "campaigns: the scheduler, processes, files, two workers, memory of a worker over 2,000 runs",
    "adversaries": "altered plans and proofs beside the exact checker; how long it checks random answers",
}
"""What every topic is about."""

WHOLE = "about forty minutes on two cores, most of it for the planner and the adversaries"
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
