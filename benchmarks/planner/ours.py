"""Answers of our planner to one question, and the time they take, in this process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time

from benchmarks.planner.family import corridor_problem, first_question
from benchmarks.questions.peers import run_trees
from coop_drake.answers import Found, PlanningProblem, PlanningResult
from coop_drake.answers.budget import Budget
from coop_drake.cli.summary import answer_of
from coop_drake.laws import ScheduledGains
from coop_drake.planning import warm_up
from coop_drake.planning.planner import plan


@dataclass(frozen=True)
class Planned:
    """One answer, its figures and its time.

    Attributes:
        answer: ``found``, ``beyond limits``, ``infeasible`` or ``undecided``.
        cpu_seconds: From the question to a plan that can be executed, or to the verdict [CPU s].
        first_plan_cpu_seconds: To the first certified plan, or to the verdict [CPU s].
        slices: Compound slices swept.
        cells: Cells of the plan, 0 if there is no plan.
        neck_m: Clearance of the plan's narrowest passage, 0 if there is no plan [m].
        transport_seconds: Estimated duration of the transport, 0 if there is no plan [s].
    """

    answer: str
    cpu_seconds: float
    first_plan_cpu_seconds: float
    slices: int
    cells: int
    neck_m: float
    transport_seconds: float


def plan_repeatedly(
    problem: PlanningProblem,
    runs: int,
    patience: float,
    budget: Budget | None = None,
    gain_set: ScheduledGains | None = None,
) -> tuple[Planned, ...]:
    """Ask the same question several times; the first time also loads the compiled kernels.

    Args:
        problem: The question.
        runs: How often, at most.
        patience: Do not ask again once an answer took longer [CPU s].
        budget: What the plans shall tolerate.
        gain_set: The rule of the gains, the default one if not given.
    """
    answers: list[Planned] = []
    while len(answers) < runs and (not answers or answers[-1].cpu_seconds < patience):
        answers.append(_planned(lambda: _ask(problem, budget, gain_set)))
    return tuple(answers)


def plan_once_warm(problem: PlanningProblem) -> Planned:
    """Ask once, after small questions have loaded the compiled kernels."""
    warm_up.main()
    _ask(first_question())
    return _planned(lambda: _ask(problem))


def compile_kernels() -> None:
    """Compile every kernel into the cache, so that no figure contains the time of compiling."""
    for question in (first_question(), corridor_problem(), corridor_problem(0.77)):
        _ask(question)
    run_trees(first_question(), (1,), 100)


def _ask(
    problem: PlanningProblem, budget: Budget | None = None, gain_set: ScheduledGains | None = None
) -> PlanningResult:
    return plan(problem, gain_set or ScheduledGains(), gain_set_name="scheduled", budget=budget)


def _planned(ask: Callable[[], PlanningResult]) -> Planned:
    start = process_time()
    result = ask()
    seconds = process_time() - start
    report = result.report
    first = report.first_plan_cpu_seconds
    found = result.plan if isinstance(result, Found) else None
    return Planned(
        answer=answer_of(result),
        cpu_seconds=seconds,
        first_plan_cpu_seconds=seconds if first is None else first,
        slices=report.slices,
        cells=0 if found is None else len(found.cells),
        neck_m=0.0 if found is None else min(t.neck for t in found.transitions),
        transport_seconds=0.0 if found is None else sum(t.estimated_time for t in found.transitions),
    )
