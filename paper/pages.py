"""The files of the report: pictures, tables in Markdown, the report in Markdown and as one HTML page."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from coop_drake.answers import Plan, table_1
from coop_drake.drawing.canvas import house_style, save_figure
from coop_drake.files import write_atomically
from coop_drake.templates import rendered
from coop_drake.viz import write_figures
from paper.approximation import two_components
from paper.approximation_figure import approximation_figure
from paper.background import explanation
from paper.errata_figure import write_errata_figure
from paper.exhibits import Agreement, Exhibit, Statement
from paper.interval_figure import interval_figure
from paper.material import Material
from paper.report import exhibits
from paper.runs import GAIN_SETS
from paper.table_1 import CORRECTED, PRINTED

__all__ = ["write_report"]

Progress = Callable[[str, float], None]


def write_report(material: Material, folder: Path, progress: Progress | None = None) -> tuple[Exhibit, ...]:
    """Write pictures, tables, ``report.md`` and ``index.html`` into a folder.

    Args:
        material: What there is to report.
        folder: It is made if it is missing.
        progress: Told the stage and the fraction done, if given.

    Returns:
        The exhibits, judged.
    """
    tell = progress if progress is not None else lambda _doing, _fraction: None
    _write_pictures(material, folder, tell)
    found = exhibits(material)
    _write_tables(material, found, folder)
    tell("page", 0.9)
    content = {
        "explanation": explanation,
        "embedded": lambda file: _embedded(folder / file),
        "exhibits": found,
        "counts": _counts(found),
        "headings": tuple(GAIN_SETS.values()),
        "background": tuple(dict.fromkeys(key for exhibit in found for key in exhibit.because)),
    }
    for name in ("report.md", "index.html"):
        write_atomically(folder / name, rendered("paper", name, **content).encode())
    return found


def _write_pictures(material: Material, folder: Path, tell: Progress) -> None:
    problem, runs = material.problem, material.runs
    folder.mkdir(parents=True, exist_ok=True)
    with house_style():
        system = two_components(problem.tree)
        save_figure(approximation_figure(system, material.made), folder / "fig03_approximations.png")
        save_figure(interval_figure(runs[0].plan), folder / "table_1.png")
    for number, run in enumerate(runs):
        tell(run.gains, (0.1 + number) / (len(runs) + 0.6))
        pictures = folder / run.gains
        pictures.mkdir(exist_ok=True)
        write_figures(problem, run.plan, run.log, pictures)
    tell("errata", 0.8)
    write_errata_figure(folder)


def _write_tables(material: Material, found: Sequence[Exhibit], folder: Path) -> None:
    write_atomically(folder / "table_1.md", _both_tables(material.runs[0].plan).encode())
    (parameters,) = (exhibit.statements for exhibit in found if exhibit.name == "Table 2")
    write_atomically(folder / "table_2.md", _parameter_table(parameters).encode())
    rows = [asdict(gains) for gains in material.played]
    write_atomically(folder / "table_1_gains.json", json.dumps(rows, indent=1).encode() + b"\n")


def _both_tables(plan: Plan) -> str:
    """Return Table 1 of our plan, and of the paper as corrected beside what it prints."""
    lines = [
        "",
        f"The paper's Table 1: its {len(CORRECTED)} cells [rad]; where a sign is corrected, in brackets as "
        "printed.",
        "",
        "| cell | theta lower | theta upper | q11 lower | q11 upper | q21 lower | q21 upper |",
        "|" + " ---: |" * (1 + CORRECTED.shape[1]),
    ]
    for number, (row, printed) in enumerate(zip(CORRECTED, PRINTED, strict=True), start=1):
        values = [
            f"{value:.3f}" if value == wrong else f"{value:.3f} ({wrong:.3f})"
            for value, wrong in zip(row, printed, strict=True)
        ]
        lines.append("| " + " | ".join([str(number), *values]) + " |")
    return table_1(plan) + "\n".join(lines) + "\n"


def _parameter_table(statements: Sequence[Statement]) -> str:
    lines = [
        "Table 2. Parameters of the simulation.",
        "",
        "| the paper | ours | agreement |",
        "| --- | --- | --- |",
    ]
    lines += [f"| {one.paper} | {one.ours[0]} | {one.agreement.value} |" for one in statements]
    return "\n".join(lines) + "\n"


def _counts(found: Sequence[Exhibit]) -> dict[Agreement, int]:
    """Return the number of statements that agree, differ or give no number."""
    agreements = [statement.agreement for exhibit in found for statement in exhibit.statements]
    return {agreement: agreements.count(agreement) for agreement in Agreement}


def _embedded(picture: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(picture.read_bytes()).decode()
