"""The command campaign: many runs by seed, their state, their report, and any of them once more."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from coop_drake.cli.campaign_state import show_state
from coop_drake.cli.options import FirstByDefault, Machine, NoFigures, Quiet, out_folder
from coop_drake.cli.reporter import ExitCode, reporting

if TYPE_CHECKING:
    from coop_drake.campaign import Campaign
    from coop_drake.campaign.batches import Batch
    from coop_drake.campaign.results import CampaignFolder

EXAMPLES = (
    ("campaign many.campaign.yaml", "make all runs, or those that are missing, into out/campaigns/many/"),
    ("campaign status many.campaign.yaml", "how far it is, what was lost, the least margins"),
    ("campaign report many.campaign.yaml", "a page with rates, distributions and the worst runs"),
    ("campaign replay many.campaign.yaml 17", "one of its runs again, with recording and figures"),
)


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
def run_command(
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
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Make all runs of a campaign and answer its questions, or those that an interruption left.

    `campaign FILE` means the same. The exit code is 1 if a run was lost or an answer is wrong.
    """
    with reporting(machine=machine, quiet=quiet) as reporter:
        campaign, folder = _read(file, out)
        from coop_drake.campaign.running import run_campaign

        with reporter.stage("campaign", "campaign") as progress:
            outcome = run_campaign(
                campaign, folder.path, workers=workers, scheduler=scheduler, progress=progress
            )
        reporter.facts["batches_made"] = outcome.made
        show_state(campaign, folder, outcome.batches, reporter)


@campaign_app.command("status")
def status_command(
    file: CampaignFile, out: CampaignOut = None, machine: Machine = False, quiet: Quiet = False
) -> None:
    """Show how far a campaign is, and what it has found so far."""
    with reporting(machine=machine, quiet=quiet) as reporter:
        campaign, folder, batches = _with_batches(file, out)
        show_state(campaign, folder, batches, reporter)
        reporter.code = ExitCode.DONE


@campaign_app.command("report")
def report_command(
    file: CampaignFile, out: CampaignOut = None, machine: Machine = False, quiet: Quiet = False
) -> None:
    """Write report.html and report.json: rates with bounds, distributions, the worst runs."""
    with reporting(machine=machine, quiet=quiet) as reporter:
        from coop_drake.campaign.report import make_report, write_report

        campaign, folder, batches = _with_batches(file, out)
        findings, breaking = folder.findings(batches)
        report = make_report(
            campaign.name,
            folder.table(batches),
            folder.questions(batches),
            facts=_facts(campaign, folder.by_other_sources(batches)),
            findings=findings,
            breaking=breaking,
            missing=len(folder.missing(batches)),
        )
        at = [] if out is None else ["--out", str(out)]
        command = ["coop-drake", "campaign", "replay", str(file)]
        written = write_report(report, folder.path, lambda run: shlex.join([*command, str(run.run), *at]))
        reporter.facts["files"] = [str(path) for path in written]
        reporter.say(f"The report is {escape(str(written[0]))}; open it in a browser")


@campaign_app.command("replay")
def replay_command(
    file: CampaignFile,
    run: Annotated[int, typer.Argument(metavar="RUN", min=0, help="Index of the run in the campaign.")],
    out: CampaignOut = None,
    no_figures: NoFigures = False,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Make one run again by Drake's loop, with recording and figures, and compare it with the counted one.

    A run of the compiled tier is made again by the compiled loop, too.
    """
    with reporting(machine=machine, quiet=quiet) as reporter:
        from coop_drake.cli.campaign_replay import replay

        campaign, folder, batches = _with_batches(file, out)
        reporter.code = replay(campaign, folder, batches, run, reporter, figures=not no_figures)


@campaign_app.command("question")
def question_command(
    file: CampaignFile,
    number: Annotated[int, typer.Argument(metavar="NUMBER", min=0, help="Number of the question.")],
    out: CampaignOut = None,
    machine: Machine = False,
    quiet: Quiet = False,
) -> None:
    """Write a random question as a scenario with its models, to be planned or looked at like any other."""
    with reporting(machine=machine, quiet=quiet) as reporter:
        from coop_drake.campaign.questions import random_question
        from coop_drake.errors import ScenarioError

        campaign, folder = _read(file, out)
        if campaign.questions is None:
            raise ScenarioError(str(file), "questions", None, "a section of questions")
        drawn = random_question(campaign.questions, number, folder.path / "drawn" / str(number))
        reporter.facts["scenario"] = str(drawn.scenario.path)
        reporter.say(f"Next: coop-drake plan {escape(str(drawn.scenario.path))}")


def _read(file: Path, out: Path | None) -> tuple[Campaign, CampaignFolder]:
    """Read a campaign file, and say where its results go."""
    from coop_drake.campaign import load_campaign
    from coop_drake.campaign.results import CampaignFolder

    campaign = load_campaign(file)
    return campaign, CampaignFolder((out or Path("out") / "campaigns" / campaign.name).absolute())


def _facts(campaign: Campaign, by_other_sources: int) -> list[tuple[str, str]]:
    """Return what a report says of what was asked for, and of batches that other sources have made."""
    from importlib.metadata import version

    facts = [("file", campaign.path.name), ("coop_drake", version("coop-drake")), ("Drake", version("drake"))]
    if campaign.runs is not None:
        facts += [("seed", str(campaign.runs.seed)), ("varied keys", str(len(campaign.runs.vary)))]
        facts += [("budget", campaign.runs.budget)] if campaign.runs.budget else []
    if by_other_sources:
        facts += [("batches by other sources of coop_drake", str(by_other_sources))]
    return facts


def _with_batches(file: Path, out: Path | None) -> tuple[Campaign, CampaignFolder, tuple[Batch, ...]]:
    from coop_drake.campaign.running.command import batches_of

    campaign, folder = _read(file, out)
    return campaign, folder, batches_of(campaign, folder)
