"""The command campaign: many runs by seed, their state, their report, and any of them once more."""

from __future__ import annotations

import shlex
from dataclasses import fields
from math import isnan, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from coop_drake.cli.options import ApartOptions, FirstByDefault, NoFigures, RunOptions, command, out_folder
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.run import carry_out, simulation_of
from coop_drake.cli.task import Task
from coop_drake.errors import ProcessError
from coop_drake.viz.drawing_processes import DrawingProcesses

if TYPE_CHECKING:
    from coop_drake.campaign import Campaign, RunRecord
    from coop_drake.campaign.file import Tier
    from coop_drake.campaign.records import Batch, CampaignFolder

EXAMPLES = (
    ("campaign many.campaign.yaml", "make all runs, or those that are missing, into out/campaigns/many/"),
    ("campaign status many.campaign.yaml", "how far it is, what was lost, the least margins"),
    ("campaign report many.campaign.yaml", "a page with rates, distributions and the worst runs"),
    ("campaign replay many.campaign.yaml 17", "one of its runs again, with recording and figures"),
)


_LOOPS = {"drake": "Drake's loop", "compiled": "the compiled loop"}

_NAMES = "run", "scenario", "tier", "seed", "values", "digest"
"""Columns of a record that say which run it is, not what it left."""

campaign_app = typer.Typer(
    cls=FirstByDefault,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Make thousands of runs by seed on this machine or on many, and report margins and losses.",
)
"""The command with those below it."""

CampaignFile = Annotated[
    Path, typer.Argument(metavar="FILE", dir_okay=False, help="Campaign file (*.campaign.yaml).")
]
CampaignOut = Annotated[
    Path | None, out_folder("Folder of the results; out/campaigns and the file's name by default.")
]


@campaign_app.command("run")
@command
def run_command(
    reporter: Reporter,
    file: CampaignFile,
    out: CampaignOut = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", metavar="N", min=1, help="Batches at a time here; one a core by default."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            help="A Dask scheduler that exists, in place of workers that are started here.",
        ),
    ] = None,
) -> None:
    """Make all runs of a campaign, or those that an interruption left.

    `campaign FILE` means the same. The exit code is 1 if a run was lost.
    """
    campaign, folder = _read(file, out)
    from coop_drake.campaign.execution import run_campaign

    with reporter.stage("campaign", "campaign") as progress:
        outcome = run_campaign(campaign, folder.path, workers=workers, scheduler=scheduler, progress=progress)
    reporter.facts["batches_made"] = outcome.made
    _show_state(campaign, folder, outcome.batches, reporter)


@campaign_app.command("status")
@command
def status_command(reporter: Reporter, file: CampaignFile, out: CampaignOut = None) -> None:
    """Show how far a campaign is, and what it has found so far."""
    campaign, folder, batches = _with_batches(file, out)
    _show_state(campaign, folder, batches, reporter)
    reporter.code = ExitCode.DONE


@campaign_app.command("report")
@command
def report_command(reporter: Reporter, file: CampaignFile, out: CampaignOut = None) -> None:
    """Write report.html and report.json: rates with bounds, distributions, the worst runs."""
    from coop_drake.campaign.report import make_report, write_report

    campaign, folder, batches = _with_batches(file, out)
    report = make_report(
        campaign.name,
        folder.table(batches),
        facts=_facts(campaign, folder.by_other_sources(batches)),
        missing=len(folder.missing(batches)),
    )
    at = [] if out is None else ["--out", str(out)]
    command = ["coop-drake", "campaign", "replay", str(file)]
    written = write_report(report, folder.path, lambda run: shlex.join([*command, str(run.run), *at]))
    reporter.facts["files"] = [str(path) for path in written]
    reporter.say(f"The report is {escape(str(written[0]))}; open it in a browser")


@campaign_app.command("replay")
@command
def replay_command(
    reporter: Reporter,
    file: CampaignFile,
    run: Annotated[int, typer.Argument(metavar="RUN", min=0, help="Index of the run in the campaign.")],
    out: CampaignOut = None,
    no_figures: NoFigures = False,
) -> None:
    """Make one run again by Drake's loop, with recording and figures, and compare it with the counted one.

    A run of the compiled tier is made again by the compiled loop, too.
    """
    campaign, folder, batches = _with_batches(file, out)
    reporter.code = _replay(campaign, folder, batches, run, reporter, figures=not no_figures)


def _read(file: Path, out: Path | None) -> tuple[Campaign, CampaignFolder]:
    """Read a campaign file, and say where its results go."""
    from coop_drake.campaign import load_campaign
    from coop_drake.campaign.records import CampaignFolder

    campaign = load_campaign(file)
    return campaign, CampaignFolder((out or Path("out") / "campaigns" / campaign.name).absolute())


def _facts(campaign: Campaign, by_other_sources: int) -> list[tuple[str, str]]:
    """Return what a report says of what was asked for, and of batches that other sources have made."""
    from importlib.metadata import version

    facts = [("file", campaign.path.name), ("coop_drake", version("coop-drake")), ("Drake", version("drake"))]
    facts += [("seed", str(campaign.runs.seed)), ("varied keys", str(len(campaign.runs.vary)))]
    facts += [("budget", campaign.runs.budget)] if campaign.runs.budget else []
    if by_other_sources:
        facts += [("batches by other sources of coop_drake", str(by_other_sources))]
    return facts


def _with_batches(file: Path, out: Path | None) -> tuple[Campaign, CampaignFolder, tuple[Batch, ...]]:
    from coop_drake.campaign.execution import batches_of

    campaign, folder = _read(file, out)
    return campaign, folder, batches_of(campaign, folder)


def _show_state(
    campaign: Campaign, folder: CampaignFolder, batches: tuple[Batch, ...], reporter: Reporter
) -> None:
    """Show what a campaign has come to so far; a lost run makes the command fail."""
    from coop_drake.campaign.records import state_of

    rows = state_of(campaign, folder, batches)
    reporter.facts.update({name: sum(row[name] for row in rows) for name in ("runs", "done", "lost")})
    reporter.facts.update(folder=str(folder.path), rows=rows)
    forms = ("{scenario}, {tier}", "{runs}", "{done}", "{lost}", "{funnel_margin:.4f}", "{clearance:.4f}")
    forms_of_costs = ("{percent:.1f} %", "{cpu_seconds:.3f}")
    texts = [
        [form.format(**row, percent=100.0 * row["budget_share"]) for form in (*forms, *forms_of_costs)]
        for row in rows
    ]
    shown = [(first, *("" if text.startswith("nan") else text for text in rest)) for first, *rest in texts]
    margins = "funnel\n(rad)", "clearance\n(m)", "of\nbudget"
    headings = ("runs", "done", "lost", *margins, "CPU\n(s)")  # Rows fit into 80 columns.
    title = f"{campaign.name}: least margins, largest share of the budget"
    reporter.table(title, shown, headings, "scenario, tier")
    if reporter.facts["lost"]:
        reporter.code = ExitCode.FAILED_RUN
    if others := folder.by_other_sources(batches):
        reporter.facts["batches_by_other_sources"] = others
        reporter.say(
            f"{others} of the batches were made by other sources of coop_drake than those of this command; "
            "with a new folder for --out they are made again"
        )
    reporter.say(f"All results are in {escape(str(folder.path))}")


def _replay(
    campaign: Campaign,
    folder: CampaignFolder,
    batches: tuple[Batch, ...],
    index: int,
    reporter: Reporter,
    *,
    figures: bool,
) -> ExitCode:
    """Make a run again by Drake's loop, with recording and figures, below the campaign's folder.

    A run of the compiled tier is made again by the compiled loop, too.

    Raises:
        ScenarioError: There is no such run.
        ProcessError: The run differs from the one that was counted.
    """
    from coop_drake.answers.log import SimulationLog
    from coop_drake.answers.plan import plan_digest
    from coop_drake.campaign.plans import Plans
    from coop_drake.campaign.runs import RunMaker, record_of_log, run_digest
    from coop_drake.campaign.variation import Variation
    from coop_drake.plant import planning_problem

    variation = Variation(campaign)
    run = variation.run(index)
    scenario = variation.scenario_of(run)
    plans = Plans(variation, folder.plans)
    plan = plans.plan_of(run)
    reporter.note(scenario.workspace.notes)
    task = Task(scenario, planning_problem(scenario))
    results = ResultFolder.of(task.name, folder.path / "replays" / str(index), "simulation")
    counted = _counted(index, "drake", folder, batches)
    simulation = simulation_of(task, reporter, ApartOptions())
    with DrawingProcesses(figures=figures) as drawing:
        code = carry_out(task, plan, results, reporter, drawing, simulation, RunOptions())
    log = SimulationLog.load(results.path / "log.npz")
    digest = run_digest(scenario, plan_digest(plan), "drake")
    drake = record_of_log(run, scenario.name, log, plan, digest)
    reporter.facts.update(run=index, counted=False)
    _compare(drake, counted, reporter)
    if any(one.tier == "compiled" and one.first <= index < one.stop for one in batches):
        compiled = RunMaker(variation, plans, "compiled", folder.path / "logs").record(run)
        _show_both(drake, compiled, reporter)
        _compare(compiled, _counted(index, "compiled", folder, batches), reporter)
    return code


def _counted(
    index: int, tier: Tier, folder: CampaignFolder, batches: tuple[Batch, ...]
) -> dict[str, Any] | None:
    """Return the record of a run in a tier, None if it was not counted."""
    mine = [one for one in batches if one.tier == tier and one.first <= index < one.stop]
    return next((row for row in folder.table(mine).to_pylist() if row["run"] == index), None)


def _compare(again: RunRecord, counted: dict[str, Any] | None, reporter: Reporter) -> None:
    loop = _LOOPS[again.tier]
    if not counted:
        reporter.say(f"Run {again.run} was not counted by {loop}; values and seed are those of any tier")
        return
    reporter.facts["counted"] = True
    differing = [name for name, value in counted.items() if not _same(value, getattr(again, name))]
    if differing:
        what = ", ".join(differing)
        raise ProcessError(f"run {again.run} of {loop} differs from the one that was counted in {what}")
    reporter.say(f"Run {again.run} of {loop} is the one that was counted, to the last bit")


def _show_both(drake: RunRecord, compiled: RunRecord, reporter: Reporter) -> None:
    """Show what a run left in both loops, and the differences of its numbers."""
    rows, facts = [], {}
    for name in (one.name for one in fields(drake) if one.name not in _NAMES):
        first, second = getattr(drake, name), getattr(compiled, name)
        facts[name] = [None if _same(value, nan) else value for value in (first, second)]
        numbers = isinstance(first, float) and isinstance(second, float)
        texts = [f"{value:.9g}" if isinstance(value, float) else str(value) for value in (first, second)]
        rows.append((name, *texts, f"{second - first:.2g}" if numbers else ""))
    reporter.facts["tiers"] = facts
    headings = "Drake's loop", "the compiled loop", "difference"
    reporter.table(f"Run {drake.run}", rows, headings, "column")


def _same(first: Any, second: Any) -> bool:
    both = isinstance(first, float) and isinstance(second, float)
    return first == second or (both and isnan(first) and isnan(second))
