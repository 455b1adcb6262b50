"""The command why: explains what keeps a scenario from having a plan."""

from __future__ import annotations

from time import process_time
from typing import TYPE_CHECKING

from rich.markup import escape

from coop_drake.cli.options import PictureFolder, ScenarioPath
from coop_drake.cli.plan import answer_to, report_answer
from coop_drake.cli.reporter import ExitCode, Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.summary import summary_rows
from coop_drake.cli.task import Task, read_task

if TYPE_CHECKING:
    from coop_drake.diagnosis import Diagnosis

EXAMPLES = (("why models/closed.scenario.yaml", "what blocks, and what would help"),)


def why_command(
    reporter: Reporter,
    scenario: ScenarioPath,
    out: PictureFolder = None,
) -> None:
    """Say why there is no plan: what blocks, where, how much is missing, and what would help."""
    from coop_drake.diagnosis import Answer, diagnose, facts_of

    task = read_task(scenario, reporter=reporter)
    folder, before = ResultFolder.of(task.name, out, "diagnosis"), process_time()
    with reporter.stage("diagnosing") as progress:
        diagnosis = diagnose(task.problem, progress)
    reporter.facts.update(facts_of(diagnosis), diagnosis_cpu_seconds=round(process_time() - before, 4))
    folder.begin("diagnosis")
    if diagnosis.answer is Answer.FOUND:
        _show_plan(task, folder, reporter)
    else:
        _show_diagnosis(diagnosis, task, folder, reporter)
        reporter.code = ExitCode.of(diagnosis.answer.value)


def _show_plan(task: Task, folder: ResultFolder, reporter: Reporter) -> None:
    """Show the rows that `plan` shows: a channel was found, of which a plan is made; limits may refuse it."""
    from coop_drake.answers import BeyondLimits
    from coop_drake.drawing import house_style, save_figure
    from coop_drake.viz.figures import refused_figure

    result = answer_to(task, reporter)
    if report_answer(task, result, None, reporter):
        reporter.table(task.name, summary_rows(reporter.facts))
        reporter.say("Nothing blocks: there is a plan")
    if isinstance(result, BeyondLimits):
        with house_style():
            figure = refused_figure(task.problem, result.plan)
            for name in ("why.png", "why.svg"):
                save_figure(figure, folder.path / name)
        reporter.say(f"The picture is {escape(str(folder.path / 'why.png'))}")


def _show_diagnosis(diagnosis: Diagnosis, task: Task, folder: ResultFolder, reporter: Reporter) -> None:
    from coop_drake.diagnosis import diagnosis_figure, rows_of, sentences_of
    from coop_drake.drawing import house_style, save_figure

    with house_style():
        figure = diagnosis_figure(task.problem, diagnosis)
        if figure is not None:
            for name in ("why.png", "why.svg"):
                save_figure(figure, folder.path / name)
    reporter.table(task.name, rows_of(diagnosis))
    for sentence in sentences_of(diagnosis):
        reporter.say(escape(sentence))
    if figure is not None:
        reporter.say(f"The picture is {escape(str(folder.path / 'why.png'))}")
