"""``python -m benchmarks``: measures and writes out/bench.json as it goes; makes studies by ``study.py``."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from typer.core import TyperGroup

from benchmarks.adversaries.measured import adversary_tasks
from benchmarks.alarms import alarm_tasks
from benchmarks.apart import apart_tasks, stops_tasks
from benchmarks.commands import bench_commands, starting_tasks
from benchmarks.compiled_runs import compiled_tasks
from benchmarks.departures import departure_tasks
from benchmarks.deployed import deployed_tasks
from benchmarks.isolated import WorkerError, in_own_process
from benchmarks.limp import limp_tasks
from benchmarks.mapping import mapping_tasks
from benchmarks.messages import message_tasks
from benchmarks.planner.ablation import ablation_tasks
from benchmarks.planner.budgeted import budget_tasks
from benchmarks.planner.contradiction import contradiction_tasks
from benchmarks.planner.critical_width import critical_width_tasks
from benchmarks.planner.growth import growth_tasks, hard_question_tasks, team_tasks
from benchmarks.planner.head_to_head import Effort, head_to_head_tasks
from benchmarks.planner.ours import compile_kernels
from benchmarks.planner.stages import stage_tasks
from benchmarks.questions.peers import has_ompl
from benchmarks.questions.question import random_question
from benchmarks.quickest import quickest_tasks
from benchmarks.rejoining import rejoining_tasks
from benchmarks.rows import Ledger, LedgerError
from benchmarks.simulating import simulating_tasks
from benchmarks.smooth import RUNS, smooth_tasks
from benchmarks.study import Study, batches_of, load_study, make_study, show_results
from benchmarks.table import TOPICS, WHOLE, show, show_contents
from benchmarks.tasks import Task, chosen, worked
from benchmarks.words import word_tasks
from coop_drake.campaign.records import CampaignFolder
from coop_drake.cli.reporter import ExitCode, reporting
from coop_drake.errors import ScenarioError

_RESULTS = Path("out/bench.json")
_FAILED, _BAD_USE, _INTERRUPTED = 1, 2, 130
_LIMIT = 80.0
_ABLATION_LIMIT = 5.0
_COMPILING_LIMIT = 600.0
_COMMANDED = ("base", "tight", "closed", "three", "elbow")


class _MeasureByDefault(TyperGroup):
    """Takes ``python -m benchmarks TOPIC`` for ``python -m benchmarks measure TOPIC``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put ``measure`` before arguments that begin with no command."""
        if not args or (args[0] not in self.commands and args[0] != "--help"):
            args = ["measure", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(cls=_MeasureByDefault, add_completion=False, pretty_exceptions_enable=False)

StudyFile = Annotated[Path, typer.Argument(metavar="FILE", dir_okay=False, help="File of a study (*.yaml).")]
StudyOut = Annotated[
    Path | None, typer.Option(help="Folder of the results; out/campaigns and the file's name by default.")
]


@app.command("study")
def study_command(
    file: StudyFile,
    out: StudyOut = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Batches at a time; one a core.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler that exists.")] = None,
    status: Annotated[bool, typer.Option("--status", help="Only show what is there.")] = False,
    machine: Annotated[bool, typer.Option("--json", help="One JSON object on standard output.")] = False,
) -> None:
    """Answer random questions and search for departures with which runs are lost, as a file asks.

    The exit code is 1 if an answer is wrong, or a run is lost inside what is certified.
    """
    with reporting(machine=machine) as reporter:
        study, folder = _read(file, out)
        if status:
            batches = batches_of(study, folder)
        else:
            with reporter.stage("study", "study") as progress:
                batches = make_study(
                    study, folder, workers=workers, scheduler=scheduler, progress=progress
                ).batches
        show_results(folder, batches, reporter)
        reporter.code = ExitCode.DONE if status else reporter.code


@app.command("question")
def question_command(
    file: StudyFile,
    number: Annotated[int, typer.Argument(metavar="NUMBER", min=0, help="Number of the question.")],
    out: StudyOut = None,
) -> None:
    """Write a random question as a scenario with its models, to be planned or looked at like any other."""
    with reporting() as reporter:
        study, folder = _read(file, out)
        if study.questions is None:
            raise ScenarioError(str(file), "questions", None, "a section of questions")
        drawn = random_question(study.questions, number, folder.path / "drawn" / str(number))
        reporter.say(f"Next: coop-drake plan {drawn.scenario.path}")


def _read(file: Path, out: Path | None) -> tuple[Study, CampaignFolder]:
    study = load_study(file)
    return study, CampaignFolder((out or Path("out") / "campaigns" / study.name).absolute())


@app.command("measure")
def main(
    topics: Annotated[
        list[str] | None,
        typer.Argument(metavar="[TOPIC]...", help=f"{', '.join(TOPICS)}; all by default."),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="A case, peer or group: base, ompl, growth, ablation, stages, no_way; may be repeated."
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Runs of every peer.")] = 10,
    budget: Annotated[float, typer.Option(min=0.1, help="CPU seconds of every run of OMPL.")] = 8.0,
    limit: Annotated[float, typer.Option(min=1.0, help="CPU seconds of every answer of ours.")] = _LIMIT,
    runs: Annotated[int, typer.Option(min=1, help="Compiled runs of each team in smooth/budget.")] = RUNS,
    jobs: Annotated[
        int, typer.Option(min=1, help="Processes at the same time, where figures stand that.")
    ] = 2,
    out: Annotated[Path, typer.Option(help="Where the rows go.")] = _RESULTS,
    listing: Annotated[bool, typer.Option("--list", help="Say what there is; measure nothing.")] = False,
) -> None:
    """Measure what exists on this machine, each figure beside a peer of the same run."""
    console = Console(stderr=True, highlight=False)
    topics = [] if topics == ["all"] else topics or []
    tasks = chosen(_tasks(Effort(seeds, budget, limit), runs), topics, only or [])
    if not tasks:
        asked = escape(" ".join([*topics, *(only or [])]))
        console.print(f"[bold red]Error:[/] nothing is called {asked}")
        raise typer.Exit(_BAD_USE)
    if listing:
        show_contents(tasks)
        raise typer.Exit
    try:
        ledger = Ledger(out, fresh=not topics and not only)
    except LedgerError as error:
        console.print(f"[bold red]Error:[/] {escape(str(error))}", soft_wrap=True)
        raise typer.Exit(_BAD_USE) from error
    if not has_ompl():
        console.print("OMPL is not installed: its rows are left out (pip install 'coop-drake\\[bench]').")
    console.print(
        f"Tasks: {len(tasks)}{'' if topics or only else f', {WHOLE}'}; Ctrl-C keeps what was measured."
    )
    code = _measure(tasks, ledger, jobs, console)
    show(ledger.rows)
    console.print(f"{len(ledger.rows)} rows are in {escape(str(out))}")
    raise typer.Exit(code)


def _tasks(effort: Effort, runs: int) -> list[Task]:
    """Everything there is to measure."""
    return [
        *head_to_head_tasks(effort),
        *ablation_tasks(min(effort.limit, _ABLATION_LIMIT)),
        *stage_tasks(effort.limit),
        *budget_tasks(effort.limit),
        *growth_tasks(effort.limit),
        *team_tasks(effort.limit),
        *hard_question_tasks(effort.limit),
        *contradiction_tasks(),
        *critical_width_tasks(),
        *starting_tasks(),
        *alarm_tasks(),
        *(_command_task(scenario) for scenario in _COMMANDED),
        *mapping_tasks(),
        *simulating_tasks(),
        *departure_tasks(),
        *deployed_tasks(),
        *compiled_tasks(),
        *adversary_tasks(),
        *message_tasks(),
        *smooth_tasks(runs),
        *quickest_tasks(),
        *word_tasks(),
        *apart_tasks(),
        *rejoining_tasks(),
        *limp_tasks(),
        *stops_tasks(),
    ]


def _command_task(scenario: str) -> Task:
    return Task(f"command/plan_{scenario}", lambda rows: bench_commands(scenario), alone=True)


def _measure(tasks: list[Task], ledger: Ledger, jobs: int, console: Console) -> int:
    """Work through the tasks; what is measured is kept even if one fails or Ctrl-C ends the work."""
    code = 0
    columns = (TextColumn("{task.description:<32}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bars:
        bar = bars.add_task("compiling", total=len(tasks))
        try:
            in_own_process(compile_kernels, limit=_COMPILING_LIMIT)
            with closing(worked(tasks, lambda: ledger.rows, jobs)) as outcomes:
                for done in outcomes:
                    bars.update(bar, advance=1, description=done.task.name)
                    if not console.is_terminal:
                        bars.print(done.task.name)
                    if done.error is not None:
                        bars.print(f"[bold red]Error:[/] {escape(str(done.error))}", soft_wrap=True)
                        code = _FAILED
                    ledger.add(done.rows)
        except WorkerError as error:
            bars.print(f"[bold red]Error:[/] {escape(str(error))}", soft_wrap=True)
            return _FAILED
        except KeyboardInterrupt:
            bars.print("Interrupted: what was measured until now is kept.")
            return _INTERRUPTED
    return code
