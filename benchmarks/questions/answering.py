"""Answers random questions, and judges answers by checks that share no computation with the planner."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

from benchmarks.questions.peers import Searched, search_by_peers
from benchmarks.questions.question import Question, random_question
from benchmarks.questions.settings import QuestionSettings
from coop_drake.answers import (
    BeyondLimits,
    Found,
    Infeasible,
    Plan,
    PlanningProblem,
    PlanningResult,
    Undecided,
)
from coop_drake.answers.document import content_digest
from coop_drake.answers.plan import SearchReport
from coop_drake.campaign.plans import versions
from coop_drake.campaign.records import Batch, CampaignFolder, Task, Work
from coop_drake.errors import PatienceError, RefusalError
from coop_drake.files import write_atomically
from coop_drake.planning import warm_up
from coop_drake.planning.planner import plan
from coop_drake.scenario import Scenario
from coop_drake.tree.arrays import FloatArray
from coop_drake.typed_data import to_plain
from coop_drake.verification import verify_plan, verify_proof
from coop_drake.verification.runs.bodies import least_distances

MEASURED = "_seconds"
"""How names of columns end that a second answer to the same question does not repeat."""


@dataclass(frozen=True)
class QuestionRecord:
    """One planning question. Columns that end in ``_seconds`` were measured, and differ between machines.

    Attributes:
        question: Index in the campaign.
        seed: Seed of the question.
        floor: Kind of floor.
        robots: Number of robots.
        joints: Number of joints of the whole team.
        kind: Shape of the object, and whether any joint slides.
        verdict: ``plan``, ``beyond limits``, ``infeasible``, ``undecided``, or ``failed`` where the planner
            raised an error.
        cpu_seconds: Processor time of the planner [s].
        first_plan_seconds: Processor time until the first plan was certified; NaN if none was [s].
        cells: Cells of the plan.
        verified: Whether the exact checker accepted the answer; false for ``undecided``.
        sampled_margin: Smallest clearance of configurations sampled along the plan; NaN without one [m].
        peer: The other planners that searched for a way; the last one found it if any did. Empty if none did.
        peer_found: Whether one was found.
        peer_seconds: Processor time of the other planners together; NaN if none searched [s].
        reason: Why the question is undecided, beyond limits, or its answer wrong, or that the time limit
            ended the improvement of its plan; else empty.
        corners: Number of corners of the floor.
        width_ratio: Width of the floor's passages over that of the narrowest straight corridor in which the
            team is known to fit; NaN on floors without passages of one width [-].
    """

    question: int
    seed: int
    floor: str
    robots: int
    joints: int
    kind: str
    verdict: str
    cpu_seconds: float = nan
    first_plan_seconds: float = nan
    cells: int = 0
    verified: bool = False
    sampled_margin: float = nan
    peer: str = ""
    peer_found: bool = False
    peer_seconds: float = nan
    reason: str = ""
    corners: int = 0
    width_ratio: float = nan

    @property
    def is_wrong(self) -> bool:
        """Whether the answer is shown to be wrong: refused, refuted by a path, in contact, or an error."""
        if self.verdict == "undecided":
            return False
        refuted = self.verdict == "infeasible" and self.peer_found
        return not self.verified or refuted or self.sampled_margin <= 0.0


_CORNERS, _BOUNDARY = 0.4, 0.3
"""Fractions of positions at corners and along the boundary of a cell, where bodies are nearest to walls."""

_ENDS = 0.7
"""Fraction of angles and joint values at the ends of their intervals."""


def sampled_margin(problem: PlanningProblem, plan: Plan, samples: int, seed: int) -> float:
    """Return the smallest distance of any body to a wall or another body in the cells of a plan [m].

    A cell states that all of its positions are free with all of its angles, so that any configuration with
    zero or less refutes the plan.

    Args:
        problem: The floor and the team.
        plan: The plan.
        samples: Configurations for each cell.
        seed: Of the samples.
    """
    random = np.random.default_rng(seed)
    drawn = []
    for cell in plan.cells:
        shares = random.random((samples, len(cell.lower)))
        shares = np.where(random.random(shares.shape) < _ENDS, np.rint(shares), shares)
        angles = cell.lower + shares * (cell.upper - cell.lower)
        drawn.append(np.column_stack((_positions(random, cell.tidied, samples), angles)))
    return float(least_distances(problem, np.concatenate(drawn)).min())


def _positions(random: np.random.Generator, region: Polygon, count: int) -> FloatArray:
    """Corners, points along the boundary and points inside, shape (count, 2) [m]."""
    all_corners = shapely.get_coordinates(region)
    corners = random.choice(all_corners, round(_CORNERS * count))
    boundary = shapely.boundary(region)
    along = random.random(round(_BOUNDARY * count))
    points = shapely.get_coordinates(shapely.line_interpolate_point(boundary, along, normalized=True))
    left = count - len(corners) - len(points)
    low, high = np.reshape(region.bounds, (2, 2))
    inside = random.uniform(low, high, (8 * left, 2))
    inside = inside[shapely.contains_xy(region, inside)][:left]
    # A thin region may hold few of the points drawn in its bounds; its corners make up for them.
    missing = random.choice(all_corners, left - len(inside))
    return np.concatenate((corners, points, inside, missing))


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
    result, told, failed = planned_in_time(question.scenario, question.problem, settings.time_limit)
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


def planned_in_time(
    scenario: Scenario, problem: PlanningProblem, limit: float
) -> tuple[PlanningResult, str, bool]:
    """Return an answer, undecided without a way in time [CPU s]; a remark; whether the planner failed."""
    end, late = process_time() + limit, ""

    def check_time(phase: str, fraction: float) -> None:
        nonlocal late
        if process_time() > end:
            late = late or f"when it was {phase}"
            raise PatienceError(f"not answered within {limit:g} s, {late}")

    name = scenario.selected_gains
    gains = scenario.gain_sets[name]
    try:
        answer = plan(problem, gains, gain_set_name=name, progress=check_time)
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


CASES = "cases"
"""Folder of questions that were answered wrongly or not at all, in that of the results."""


def question_batches(settings: QuestionSettings) -> Iterator[Batch]:
    """Yield all batches of questions; what one leaves does not depend on how many others there are."""
    asked = to_plain(replace(settings, count=1, batch=1), QuestionSettings)
    for first in range(0, settings.count, settings.batch):
        stop = min(first + settings.batch, settings.count)
        content = {"questions": asked, "versions": versions(), "first": first, "stop": stop}
        yield Batch(0, "planner", first, stop, content_digest(content), f"{__name__}:QUESTIONS")


def tasks(order: dict[str, Any], alive: Callable[[], None]) -> Iterator[Task]:
    """Yield the questions of a batch that are to be answered; kernels are loaded before their time counts."""
    from benchmarks.study import load_study

    folder = CampaignFolder(Path(order["folder"]))
    settings = load_study(folder.campaign, Path(order["campaign"])).questions
    assert settings is not None  # or there would be no batches
    warm_up.main()
    for number in range(order["begin"], order["batch"]["stop"]):
        yield begun_question(settings, number), partial(ask, number, settings, folder.path / CASES)


QUESTIONS = Work("questions", QuestionRecord, f"{__name__}:tasks")
"""Planning questions."""
