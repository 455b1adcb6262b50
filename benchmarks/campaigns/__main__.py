"""``python -m benchmarks.campaigns``: makes campaigns and studies of this folder, and prints their tables.

They take hours, at the lowest priority. What is there is kept: the same command goes on after an
interruption. Tables are Markdown.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

from benchmarks import study
from coop_drake.campaign import load_campaign
from coop_drake.campaign.execution import batches_of
from coop_drake.campaign.records import CampaignFolder
from coop_drake.campaign.report import MARGINS, SHARE, Report, make_report, percent, percent_up

NAMES = ("breaking", "searches", "questions", "inside_budgets", "drake_inside_budgets")
"""The campaigns in the order in which they are made: what takes longest comes last."""

_HERE = Path(__file__).parent
_LEAST_PRIORITY = 19
_FINISHED = (0, 1)
"""Exit codes of a campaign that came to its end; 1 says that something was lost or wrong."""

Line = Sequence[object]


def main(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME]...", help=", ".join(NAMES))] = None,
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = Path("out/campaigns"),
    workers: Annotated[int | None, typer.Option(min=1, help="Batches at a time; one a core.")] = None,
    tables: Annotated[bool, typer.Option("--tables", help="Only print what is there already.")] = False,
) -> None:
    """Make the campaigns of the documentation, or the rest of them, and print their tables."""
    if unknown := sorted(set(names or []) - set(NAMES)):
        typer.echo(f"Error: names: {', '.join(unknown)}; allowed is any of {', '.join(NAMES)}", err=True)
        raise typer.Exit(2)
    code = 0
    for name in names or NAMES:
        (file,), folder = _HERE.glob(f"{name}.*.yaml"), out / name
        if not tables:
            code = max(code, _made(file, folder, workers))
        print("\n".join(_tables(file, CampaignFolder(folder.absolute()))), flush=True)
    raise typer.Exit(code)


def _made(file: Path, folder: Path, workers: int | None) -> int:
    """Make a campaign with its report, or a study, in processes of the lowest priority; return the exit code.

    Raises:
        Exit: It did not come to its end; with its exit code.
    """
    campaign = [sys.executable, "-c", "from coop_drake.cli import main; main()", "campaign"]
    others = [sys.executable, "-m", "benchmarks", "study"]
    options = [str(file), "--out", str(folder)]
    done = subprocess.run(
        [*(others if _is_study(file) else [*campaign, "run"]), *options]
        + (["--workers", str(workers)] if workers else []),
        preexec_fn=lambda: os.nice(_LEAST_PRIORITY),
        check=False,
    )
    if done.returncode not in _FINISHED:
        raise typer.Exit(done.returncode)
    if not _is_study(file):
        subprocess.run([*campaign, "report", *options], check=True)
    return done.returncode


def _is_study(file: Path) -> bool:
    return file.name.endswith(".study.yaml")


def _tables(file: Path, folder: CampaignFolder) -> Iterator[str]:
    """Yield the lines of the tables of a campaign or of a study."""
    if _is_study(file):
        batches = study.batches_of(study.load_study(file), folder)
        results = study.results_of(folder, batches)
        tables: list[Iterator[Line]] = [
            iter([(first, *(heading.replace("\n", " ") for heading in headings)), *rows])
            for _, rows, headings, first in study.tables(results)
        ]
    else:
        campaign = load_campaign(file)
        batches = batches_of(campaign, folder)
        tables = [_runs(make_report(campaign.name, folder.table(batches)))]
    there = len(batches) - len(folder.missing(batches))
    yield f"\n## {file.name.partition('.')[0]}: {there} of {len(batches)} batches"
    yield f"\nCPU time of each, with its share of starting processes: {folder.cpu_seconds(batches):.3g} s\n"
    for table in tables:
        yield from _markdown(table)


def _markdown(lines: Iterator[Line]) -> Iterator[str]:
    """Yield a table in Markdown of lines of which the first has the headings; nothing without others."""
    heads, *rows = list(lines)
    if rows:
        for line in (heads, ["---"] * len(heads), *rows):
            yield "| " + " | ".join(str(cell) for cell in line) + " |"
        yield ""


def _runs(report: Report) -> Iterator[Line]:
    yield "runs", "tier", "number", "lost", "at most", *(f"{m.label} [{m.unit}]" for m in MARGINS), "used"
    for group in report.groups:
        least = {name: values.least for name, values in group.measures.items()}
        used = percent(group.measures[SHARE].largest) if SHARE in group.measures else ""
        margins = (m.shown(least[m.name]) if m.name in least else "" for m in MARGINS)
        rate = group.rate
        yield group.scenario, group.tier, rate.runs, rate.lost, percent_up(rate.upper), *margins, used


if __name__ == "__main__":
    typer.run(main)
