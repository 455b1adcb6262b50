"""The report as one self-contained HTML page, and the same numbers as JSON."""

from __future__ import annotations

from collections.abc import Callable
from math import isnan, nan
from pathlib import Path
from typing import Any

from coop_drake.campaign.report.columns import COSTS, MARGINS, MEASURES, Measure
from coop_drake.campaign.report.distributions import Group
from coop_drake.campaign.report.document import Report
from coop_drake.campaign.report.figures import breaking_svg, distributions_svg, growth_svg
from coop_drake.campaign.report.influences import Influence
from coop_drake.campaign.report.rates import percent
from coop_drake.campaign.report.searches import summarise_searches
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
    agreed = [one for one in MEASURES if any(one.name in pair.largest for pair in report.agreements)]
    return rendered(
        "coop_drake.campaign.report",
        "report.html",
        report=report,
        headline=headline(report),
        good=not (report.rate and report.rate.lost)
        and all(one.arrived for one in report.findings) and not any(row.wrong for row in report.questions),
        rows=[_row(group) for group in report.groups],
        margins=MARGINS,
        table=_influence_table(report.influences),
        varied=[measure for measure in MARGINS if any(i.measure == measure.name for i in report.influences)],
        worst=[(run, _shown(run.measure, run.margin), replay(run)) for run in report.worst],
        agreed=agreed,
        agreements=[
            (one, [_shown(measure.name, one.largest.get(measure.name, nan)) for measure in agreed])
            for one in report.agreements
        ],
        searched=summarise_searches(report.findings),
        shown=_shown,
        percent=percent,
        figures={
            "margins": distributions_svg(report.groups, MARGINS),
            "costs": distributions_svg(report.groups, COSTS),
            "breaking": breaking_svg(report.breaking),
            "growth": growth_svg(report.questions),
        },
        colours=colours,
    )  # fmt: skip


def headline(report: Report) -> str:
    """The most important sentence of a report."""
    if report.rate is not None:
        return report.rate.sentence
    if report.questions:
        every = report.questions[-1]
        wrong = "1 wrong answer" if every.wrong == 1 else f"{every.wrong:,} wrong answers"
        return f"{every.count:,} questions: {wrong}, {every.undecided:,} undecided."
    if report.findings:
        lost = sum(not one.arrived for one in report.findings)
        runs = sum(one.evaluations for one in report.findings)
        found = "None" if lost == 0 else f"{lost:,}"
        return f"{found} of {len(report.findings):,} searches, with {runs:,} runs, found a run that is lost."
    if report.breaking:
        least = min(report.breaking, key=lambda point: point.kept)
        name = least.departure.replace("_", " ")
        return f"No run was lost up to {least.kept:.2g} times what is certified ({name}, {least.scenario})."
    return "There are no results yet."


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


def _influence_table(found: tuple[Influence, ...]) -> list[tuple[str, list[dict[str, Any] | None]]]:
    """One row for each key: for every margin how much is taken, and how dark the cell is."""
    largest = {
        measure.name: max((one.taken for one in found if one.measure == measure.name), default=0.0)
        for measure in MARGINS
    }
    shown = [measure for measure in MARGINS if largest[measure.name] > 0.0]
    rows = []
    for key in dict.fromkeys(one.key for one in found):
        own = {one.measure: one for one in found if one.key == key}
        cells: list[dict[str, Any] | None] = []
        for measure in shown:
            one = own.get(measure.name)
            clear = one is not None and one.clear
            cells.append(
                None if one is None or not clear else
                {
                    "taken": measure.shown(one.taken),
                    "worst": f"{one.worst:.3g}",
                    "depth": round(100.0 * one.taken / largest[measure.name]),
                }
            )  # fmt: skip
        rows.append((key, cells))
    return rows
