"""What the command campaign shows of results: tables of runs, questions, searches and bisections."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape

from coop_drake.cli.reporter import ExitCode, Reporter

if TYPE_CHECKING:
    from coop_drake.campaign import Campaign
    from coop_drake.campaign.batches import Batch
    from coop_drake.campaign.results import CampaignFolder


def show_state(
    campaign: Campaign, folder: CampaignFolder, batches: tuple[Batch, ...], reporter: Reporter
) -> None:
    """Show what a campaign has come to so far; a lost run or a wrong answer makes the command fail."""
    reporter.facts["folder"] = str(folder.path)
    if campaign.questions is not None:
        _show_questions(campaign, folder, batches, reporter)
    if campaign.runs is not None:
        _show_runs(campaign, folder, batches, reporter)
    if campaign.searches is not None or campaign.breaking is not None:
        _show_searches(folder, batches, reporter)
    for kind in ("planner", "search", "breaking"):
        _show_cost(folder, [one for one in batches if one.tier == kind], kind, reporter)
    if others := folder.by_other_sources(batches):
        reporter.facts["batches_by_other_sources"] = others
        reporter.say(
            f"{others} of the batches were made by other sources of coop_drake than those of this command; "
            "with a new folder for --out they are made again"
        )
    reporter.say(f"All results are in {escape(str(folder.path))}")


def _show_cost(folder: CampaignFolder, batches: list[Batch], kind: str, reporter: Reporter) -> None:
    """Say how much processor time what is no run has taken, where this is known."""
    from math import isnan

    if not isnan(seconds := folder.cpu_seconds(batches)):
        name = {"planner": "question", "search": "search", "breaking": "bisection"}[kind]
        reporter.facts[f"cpu_seconds_of_a_{name}"] = seconds
        reporter.say(
            f"A {name} took {seconds:.2f} s of processor time in the mean, with all its checks and runs"
        )


def _show_runs(
    campaign: Campaign, folder: CampaignFolder, batches: tuple[Batch, ...], reporter: Reporter
) -> None:
    """Show the state of every scenario in every tier; a lost run makes the command fail."""
    from coop_drake.campaign.state import state_of

    rows = state_of(campaign, folder, batches)
    reporter.facts.update(
        runs=sum(row.runs for row in rows),
        done=sum(row.done for row in rows),
        lost=sum(row.lost for row in rows),
        rows=[row.facts() for row in rows],
    )
    margins = "funnel\n(rad)", "clearance\n(m)", "of\nbudget"
    headings = ("runs", "done", "lost", *margins, "CPU\n(s)")  # Rows fit into 80 columns.
    title = f"{campaign.name}: least margins, largest share of the budget"
    reporter.table(title, [row.cells() for row in rows], headings, "scenario, tier")
    if reporter.facts["lost"]:
        reporter.code = ExitCode.FAILED_RUN


def _show_questions(
    campaign: Campaign, folder: CampaignFolder, batches: tuple[Batch, ...], reporter: Reporter
) -> None:
    """Show how questions were answered, by what makes them hard; a wrong answer makes the command fail."""
    from dataclasses import asdict

    from coop_drake.campaign.report.questions import summarise_questions

    table = folder.questions(batches)
    rows = summarise_questions(table) if table.num_rows else ()
    reporter.facts["questions"] = [asdict(row) for row in rows]
    headings = (
        "asked",
        "plans",
        "beyond\nlimits",
        "no\nway",
        "un-\ndecided",
        "wrong",
        "CPU\ntime",
        "95 %",
        "largest",
    )
    if rows:
        reporter.table(campaign.name, [row.cells() for row in rows], headings, "questions by", padding=0)
    if rows and rows[-1].wrong:
        reporter.code = ExitCode.FAILED_RUN


def _show_searches(folder: CampaignFolder, batches: tuple[Batch, ...], reporter: Reporter) -> None:
    """Show what searches and bisections have found; a loss inside the budget makes the command fail."""
    from dataclasses import asdict

    from coop_drake.campaign.report.bisections import is_good, multiple_shown
    from coop_drake.campaign.report.searches import summarise_searches

    findings, points = folder.findings(batches)
    reporter.facts["searches"] = [asdict(one) for one in findings]
    reporter.facts["breaking"] = [{**asdict(one), "lost": one.beyond} for one in points]
    if findings:
        rows = [
            (
                f"{row.scenario}, {row.margin.replace('_', ' ')}",
                *map(str, (row.searches, row.runs, row.lost, row.failed)),
                *(f"{number:.4f}" for number in (row.before, row.typical, row.worst.worst)),
            )
            for row in summarise_searches(findings)
        ]
        heads = "searches", "runs", "found\na loss", "not\nmade", "random", "usual\nfind", "worst\nfind"
        reporter.table("searches", rows, heads, "scenario, driven", padding=0)
    if points:
        rows = [
            (
                f"{one.scenario}, {one.departure}",
                f"{one.certified:g}",
                multiple_shown(one),
                one.reason or "none",
            )
            for one in points
        ]
        headings = ("certified", "largest multiple without a loss", "the loss")
        reporter.table("breaking points", rows, headings, "departure")
    if not all(one.arrived for one in findings) or not all(map(is_good, points)):
        reporter.code = ExitCode.FAILED_RUN
