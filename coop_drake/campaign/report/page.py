"""The report as one self-contained HTML page, and the same numbers as JSON."""

from __future__ import annotations

from collections.abc import Callable
from math import isnan
from pathlib import Path
from typing import Any

from coop_drake.campaign.report.columns import COSTS, MARGINS, MEASURES, Measure
from coop_drake.campaign.report.distributions import Group
from coop_drake.campaign.report.document import Report
from coop_drake.campaign.report.figures import distributions_svg
from coop_drake.campaign.report.rates import percent, percent_up
from coop_drake.campaign.report.worst import WorstRun
from coop_drake.drawing import colours
from coop_drake.files import write_atomically
from coop_drake.templates import rendered

PAGE, NUMBERS = "report.html", "report.json"
"""Names of the two files."""

_BY_NAME = {measure.name: measure for measure in MEASURES}


def write_report(report: Report, directory: Path, replay: Callable[[WorstRun], str]) -> list[Path]:
    """Write the page and the numbers into a directory, and return the two files.

    Args:
        report: What the campaign found.
        directory: Where; it is made if it is not there.
        replay: Returns the command that replays a run.
    """
    directory.mkdir(parents=True, exist_ok=True)
    page = render_page(report, replay)
    return [
        write_atomically(directory / PAGE, page.encode()),
        write_atomically(directory / NUMBERS, report.to_json().encode()),
    ]


def render_page(report: Report, replay: Callable[[WorstRun], str]) -> str:
    """Return the page as HTML; it needs no other file and no script."""
    return rendered(
        "coop_drake.campaign.report",
        "report.html",
        report=report,
        headline=headline(report),
        verdict=verdict(report),
        rows=[_row(group) for group in report.groups],
        margins=MARGINS,
        worst=[(run, _shown(run.measure, run.margin), replay(run)) for run in report.worst],
        percent=percent,
        percent_up=percent_up,
        figures={
            "margins": distributions_svg(report.groups, MARGINS),
            "costs": distributions_svg(report.groups, COSTS),
        },
        colours=colours,
    )


def headline(report: Report) -> str:
    """The most important sentence of a report, and whether it is complete."""
    told = []
    if report.rate is not None:
        told.append(report.rate.sentence)
    if report.exceeded:
        runs = "1 run" if report.exceeded == 1 else f"{report.exceeded:,} runs"
        told.append(f"{runs} used more than the budget states, up to {percent(report.most_used)} of it.")
    if report.missing:
        several = "1 batch is" if report.missing == 1 else f"{report.missing:,} batches are"
        told.append(f"The campaign is not complete: {several} missing.")
    return " ".join(told) or "There are no results yet."


def verdict(report: Report) -> str:
    """``bad`` where a run was lost; ``some`` where more was used than is budgeted, or results are missing."""
    if report.rate is not None and report.rate.lost:
        return "bad"
    return "some" if report.exceeded or report.missing else "good"


def _shown(name: str, number: float) -> str:
    measure: Measure | None = _BY_NAME.get(name)
    return f"{measure.shown(number)} {measure.unit}" if measure is not None and not isnan(number) else ""


def _row(group: Group) -> dict[str, Any]:
    """What the first table shows of a group."""
    least = {
        one.name: one.shown(group.measures[one.name].least) for one in MARGINS if one.name in group.measures
    }
    time, force = group.measures.get("time"), group.measures.get("peak_force")
    return {
        "group": group,
        "least": least,
        "time": "" if time is None else f"{time.median:.1f} s, {time.largest:.1f} s",
        "force": "" if force is None else f"{force.largest:.0f} N",
    }
