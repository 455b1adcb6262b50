"""Answers one random question, and judges the answer by checks that share no computation with the planner."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import shapely

from benchmarks.questions.peers import Searched, search_by_peers
from benchmarks.questions.question import Question, random_question
from benchmarks.questions.record import QuestionRecord
from benchmarks.questions.sampled_cells import sampled_margin
from benchmarks.questions.settings import QuestionSettings
from coop_drake.answers import BeyondLimits, Found, Infeasible, PlanningResult, Undecided
from coop_drake.answers.search_report import SearchReport
from coop_drake.errors import PatienceError, RefusalError
from coop_drake.files import write_atomically
from coop_drake.planning.planner import plan
from coop_drake.verification import verify_plan, verify_proof

VERDICTS = {
    Found: "plan",
    BeyondLimits: "beyond limits",
    Infeasible: "infeasible",
    Undecided: "undecided",
}
"""Names of the planner's answers in records."""


LATE = "the search for a better plan was ended"
"""How the remark begins of a plan that was not improved to the end."""


def ask(number: int, settings: QuestionSettings, cases: Path | None = None) -> QuestionRecord:
    """Draw one question, answer it and judge the answer.

    Args:
        number: Number of the question.
        settings: What is drawn, and how it is judged.
        cases: Folder that receives the scenario, its models and what was found, if the answer is wrong or
            undecided; None to keep nothing.
    """
    with TemporaryDirectory() as folder:
        question = random_question(settings, number, Path(folder))
        record, found = answer(question, settings)
        if cases is not None and (record.is_wrong or record.verdict == "undecided"):
            _keep(question, record, found, cases / f"{question.seed}_{number}")
    return record


def begun_question(settings: QuestionSettings, number: int) -> QuestionRecord:
    """Return the record of a question while it is answered; it stays so if its process is lost."""
    return QuestionRecord(number, settings.seed(number), "", 0, 0, "", "failed")


def answer(question: Question, settings: QuestionSettings) -> tuple[QuestionRecord, Searched]:
    """Answer a question with the planner, check the answer, and let other planners search against a "no".

    A plan and a proof are given to the exact checker; the cells of a plan are sampled, too.

    Args:
        question: The question.
        settings: Limits of time, and how many configurations are sampled.

    Returns:
        The record, and what the other planners found.
    """
    began = process_time()
    result, told, failed = _planned(question, settings.time_limit)
    record = replace(_described(question, result), cpu_seconds=process_time() - began)
    record = replace(record, verdict="failed" if failed else record.verdict, reason=told or record.reason)
    refusal = _refusal(question, result)
    record = replace(record, verified=refusal == "", reason=record.reason or refusal or "")
    if isinstance(result, Found | BeyondLimits):
        margin = sampled_margin(question.problem, result.plan, settings.samples, question.number)
        return replace(record, sampled_margin=margin), Searched()
    seconds = settings.peer_time if isinstance(result, Infeasible) else settings.patient_peer_time
    if seconds == 0.0:
        return record, Searched()
    found = search_by_peers(question.problem, seconds, 1 + question.number)
    searched = replace(
        record, peer=", ".join(found.planners), peer_found=found.path is not None, peer_seconds=found.seconds
    )
    return searched, found


def _planned(question: Question, limit: float) -> tuple[PlanningResult, str, bool]:
    """The answer, undecided without a certified way in time; a remark; and whether the planner failed."""
    end, late = process_time() + limit, ""

    def check_time(phase: str, fraction: float) -> None:
        nonlocal late
        if process_time() > end:
            late = late or f"when it was {phase}"
            raise PatienceError(f"not answered within {limit:g} s, {late}")

    scenario = question.scenario
    name = scenario.selected_gains
    gains = scenario.gain_sets[name]
    try:
        answer = plan(question.problem, gains, gain_set_name=name, progress=check_time)
    except PatienceError as error:
        return Undecided(str(error), SearchReport(0)), "", False
    except Exception as error:  # Whatever it is, it is a fault of the planner, to be counted as one.
        return Undecided("", SearchReport(0)), f"{type(error).__name__}: {error}", True
    ended = f"{LATE} after {limit:g} s, {late}" if late and isinstance(answer, Found) else ""
    return answer, ended, False


def _described(question: Question, result: PlanningResult) -> QuestionRecord:
    problem = question.problem
    first = result.report.first_plan_cpu_seconds
    return QuestionRecord(
        question.number,
        question.seed,
        question.floor,
        question.robots,
        len(problem.tree.joints),
        question.kind,
        VERDICTS[type(result)],
        first_plan_seconds=nan if first is None else first,
        cells=len(result.plan.cells) if isinstance(result, Found | BeyondLimits) else 0,
        reason=result.reason if isinstance(result, Undecided | BeyondLimits) else "",
        # Every ring repeats its first corner at its end.
        corners=int(shapely.get_num_coordinates(problem.workspace)) - 1 - len(problem.workspace.interiors),
        width_ratio=question.width_ratio,
    )


def _refusal(question: Question, result: PlanningResult) -> str | None:
    """Why the exact checker refuses an answer, empty if it accepts it; None if there is nothing to check."""
    try:
        if isinstance(result, Found | BeyondLimits):
            verify_plan(result.plan, question.problem, question.scenario.gain_sets)
        elif isinstance(result, Infeasible):
            if result.proof is None:
                return "there is no proof that no plan exists"
            verify_proof(result.proof, question.problem)
        else:
            return None
    except RefusalError as refusal:
        return str(refusal)
    return ""


def _keep(question: Question, record: QuestionRecord, found: Searched, folder: Path) -> None:
    """Copy the scenario and its models, and write the record and the other planner's path beside them."""
    shutil.copytree(question.scenario.path.parent, folder, dirs_exist_ok=True)
    path = None if found.path is None else found.path.tolist()
    text = json.dumps({"record": record.__dict__, "path": path}, indent=1) + "\n"
    write_atomically(folder / "found.json", text.encode())
