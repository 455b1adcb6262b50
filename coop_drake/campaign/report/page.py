"""The report as one self-contained HTML page, and the same numbers as JSON."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite, isnan, nan
from pathlib import Path
from typing import Any

from coop_drake.campaign.report.bisections import ends_shown, is_good, multiple_shown, sentences
from coop_drake.campaign.report.columns import COSTS, MARGINS, MEASURES, SHARE, Measure
from coop_drake.campaign.report.distributions import Group
from coop_drake.campaign.report.document import Report
from coop_drake.campaign.report.figures import breaking_svg, distributions_svg, growth_svg, searches_svg
from coop_drake.campaign.report.influences import Influence
from coop_drake.campaign.report.questions import seconds_shown
from coop_drake.campaign.report.rates import percent, percent_up
from coop_drake.campaign.report.searches import found_loss, is_made, summarise_searches
from coop_drake.campaign.report.worst import WorstRun
from coop_drake.campaign.search.findings import BreakingPoint, Finding
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
    searched = summarise_searches(report.findings)
    agreed = [one for one in MEASURES if any(one.name in pair.largest for pair in report.agreements)]
    return rendered(
        "coop_drake.campaign.report",
        "report.html",
        report=report,
        headline=headline(report),
        verdict=verdict(report),
        rows=[_row(group) for group in report.groups],
        margins=MARGINS,
        table=_influence_table(report.influences),
        varied=_varied(report.influences),
        worst=[(run, _shown(run.measure, run.margin), replay(run)) for run in report.worst],
        agreed=agreed,
        agreements=[
            (one, [_shown(measure.name, one.largest.get(measure.name, nan)) for measure in agreed])
            for one in report.agreements
        ],
        searched=searched,
        broken=_broken(report.breaking),
        ends=[(point, ends_shown(point)) for point in report.breaking],
        seconds=seconds_shown,
        shown=_shown,
        percent=percent,
        percent_up=percent_up,
        figures={
            "margins": distributions_svg(report.groups, MARGINS),
            "costs": distributions_svg(report.groups, COSTS),
            "breaking": breaking_svg(report.breaking),
            "searches": searches_svg(searched),
            "growth": growth_svg(report.questions),
        },
        colours=colours,
    )  # fmt: skip


def headline(report: Report) -> str:
    """The most important sentence of a report, what is bad of its bisections, and whether it is complete."""
    main, broken = _main_sentence(report), sentences(report.breaking)
    told = [main] if main else []
    if not main or not all(map(is_good, report.breaking)):
        told += broken
    if report.missing:
        several = "1 batch is" if report.missing == 1 else f"{report.missing:,} batches are"
        told.append(f"The campaign is not complete: {several} missing.")
    return " ".join(told) or "There are no results yet."


def _main_sentence(report: Report) -> str:
    """Say what runs, questions or searches found; empty without any of them."""
    if report.rate is not None:
        return report.rate.sentence + _beyond(report.exceeded, report.most_used, "run")
    if report.questions:
        every = report.questions[-1]
        wrong = "1 wrong answer" if every.wrong == 1 else f"{every.wrong:,} wrong answers"
        return f"{every.count:,} questions: {wrong}, {every.undecided:,} undecided."
    if report.findings:
        return _searches_sentence(report.findings)
    return ""


def _searches_sentence(findings: tuple[Finding, ...]) -> str:
    """Say how many searches found a lost run, and how many could not be made."""
    made = [one for one in findings if is_made(one)]
    lost, runs = sum(map(found_loss, made)), sum(one.evaluations for one in made)
    several = "1 search" if len(made) == 1 else f"{len(made):,} searches"
    told = []
    if made:
        number = f"{lost:,}" if lost else "None"
        told.append(f"{number} of {several}, with {runs:,} runs, found a run that is lost.")
    if failed := len(findings) - len(made):
        told.append(f"{failed:,} search{'es' if failed > 1 else ''} could not be made.")
    used = [one.worst for one in made if one.margin == SHARE and isfinite(one.worst)]
    return " ".join(told) + _beyond(sum(one > 1.0 for one in used), max(used, default=nan), "search")


def verdict(report: Report) -> str:
    """``bad`` where something was lost, wrong or not known.

    ``some`` where more was used than is budgeted, or where results are missing.
    """
    lost = (report.rate is not None and report.rate.lost) or not all(one.arrived for one in report.findings)
    if lost or any(row.wrong for row in report.questions) or not all(map(is_good, report.breaking)):
        return "bad"
    found = any(one.margin == SHARE and one.worst > 1.0 for one in report.findings)
    return "some" if report.exceeded or found or report.missing else "good"


def _beyond(count: int, most: float, what: str) -> str:
    """Say that runs came nearer to their limits than a budget states; empty where none did."""
    if count == 0:
        return ""
    several = f"{count:,} {what}{'es' if what == 'search' else 's'}" if count > 1 else f"1 {what}"
    return f" {several} used more than the budget states, up to {percent(most)} of it."


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


def _broken(points: tuple[BreakingPoint, ...]) -> dict[str, Any]:
    """Scenarios, and for each departure a row: the multiple of every scenario, and whether it is good."""
    names = list(dict.fromkeys(point.scenario for point in points))
    rows = []
    for departure in dict.fromkeys(point.departure for point in points):
        own = {point.scenario: point for point in points if point.departure == departure}
        points_shown = [own.get(name) for name in names]
        rows.append((departure, [(multiple_shown(one), one is None or is_good(one)) for one in points_shown]))
    return {"scenarios": names, "rows": rows}


def _varied(found: tuple[Influence, ...]) -> list[Measure]:
    """The margins of which any key clearly takes something."""
    return [one for one in MARGINS if any(i.measure == one.name and i.clear for i in found)]


def _influence_table(found: tuple[Influence, ...]) -> list[tuple[str, list[dict[str, Any] | None]]]:
    """One row for each key: for every margin how much is taken, and how dark the cell is."""
    shown = _varied(found)
    largest = {
        measure.name: max(one.taken for one in found if one.measure == measure.name) for measure in shown
    }
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
                    "depth": round(100.0 * one.taken / (largest[measure.name] or 1.0)),
                }
            )  # fmt: skip
        rows.append((key, cells))
    return rows
