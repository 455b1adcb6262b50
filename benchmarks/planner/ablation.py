"""What the parts of the search are worth: without samples, by cells alone, and as the paper prints it.

Every variant is asked at margin zero for a free channel or a proof that there is none: only searches are
compared. ``everything`` is the planner's own, up to its first certified plan; ``proofs`` leaves the sampled
paths out; ``cells`` leaves the relaxations out, too; ``paper`` is the paper's Algorithms 1 and 2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import process_time
from typing import Literal

from benchmarks.isolated import in_own_process
from benchmarks.planner.family import corridor_problem, first_question
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake.answers import PlanningProblem
from coop_drake.planning import find_channel
from coop_drake.planning.cells.exploration import Exploration, Verdict
from coop_drake.planning.channel import Channel
from coop_drake.planning.proofs import Proofs

SLICES = 50_000
"""Slices that a variant may make; the CPU time ends most of them sooner."""
FIRST_SLICES = 64
"""Slices of each exploration in the first round of proofs; every further round doubles it."""
Came = tuple[str, int, float | None]
"""An answer, the slices made, and when the first plan was certified if that was before the end [CPU s]."""


@dataclass(frozen=True)
class Answered:
    """The answer of a variant, and its work.

    Attributes:
        answer: ``found``, ``infeasible`` or ``undecided``.
        cpu_seconds: What it took [CPU s].
        slices: Compound slices made, boxes along sampled paths included.
    """

    answer: str
    cpu_seconds: float
    slices: int


def ablation_tasks(limit: float) -> list[Task]:
    """One task for every case.

    Args:
        limit: CPU time of every variant [s].
    """
    cases = {
        "base": corridor_problem(1.2),
        "tight": corridor_problem(0.9),
        "closed": corridor_problem(0.77),
        "three_closed": corridor_problem(0.95, 1.5, robots=3),
        "elbow_closed": corridor_problem(0.6, joints_per_arm=2),
    }
    return [_task(name, problem, limit) for name, problem in cases.items()]


def _task(name: str, problem: PlanningProblem, limit: float) -> Task:
    return Task(f"planner/ablation/{name}", lambda rows: ablation_rows(name, problem, limit))


def ablation_rows(name: str, problem: PlanningProblem, limit: float) -> list[Row]:
    """Ask every variant in a process of its own; times are compared with the whole planner's search."""
    rows, whole = [], None
    for variant in VARIANTS:
        done = in_own_process(answer, problem, variant, limit=limit)
        what, answered = f"planner/ablation/{name}/{variant}", done.value
        if answered is None:
            rows.append(Row(f"{what}/answer", 0.0, f"none within {limit:g} CPU s"))
            continue
        whole = answered.cpu_seconds if variant == "everything" else whole
        peer = "" if variant == "everything" else "everything"
        rows += [
            Row(f"{what}/answer", float(answered.answer != "undecided"), answered.answer),
            Row(f"{what}/cpu_seconds", answered.cpu_seconds, "s", peer, whole if peer else None),
            Row(f"{what}/slices", answered.slices, "slices"),
        ]
    return rows


def answer(problem: PlanningProblem, variant: str) -> Answered:
    """Ask one variant, after a small question has loaded the compiled kernels."""
    ask = VARIANTS[variant]
    ask(_at_margin_zero(first_question()))
    question = _at_margin_zero(problem)
    start = process_time()
    word, slices, first = ask(question)
    return Answered(word, process_time() - start if first is None else first, slices)


def _at_margin_zero(problem: PlanningProblem) -> PlanningProblem:
    return replace(problem, settings=replace(problem.settings, margin=0.0, max_slices=SLICES))


def _searched(strategy: Literal["portfolio", "paper"]) -> Callable[[PlanningProblem], Came]:
    def ask(problem: PlanningProblem) -> Came:
        settings = replace(problem.settings, strategy=strategy)
        channel, report = find_channel(replace(problem, settings=settings))
        if isinstance(channel, Channel):
            return "found", report.slices, report.first_plan_cpu_seconds
        return "infeasible" if channel.proved else "undecided", report.slices, None

    return ask


def _proved(problem: PlanningProblem) -> Came:
    proofs, share, verdict = Proofs(problem), FIRST_SLICES, Verdict.BUDGET
    while verdict is Verdict.BUDGET and share <= problem.settings.max_slices:
        verdict, share = proofs.run(share), 2 * share
    return _word(verdict), proofs.slices, None


def _explored(problem: PlanningProblem) -> Came:
    outcome = Exploration(problem).run(problem.settings.max_slices)
    return _word(outcome.verdict), outcome.slices, None


def _word(verdict: Verdict) -> str:
    decided = {Verdict.FOUND: "found", Verdict.INFEASIBLE: "infeasible"}
    return decided.get(verdict, "undecided")


VARIANTS: dict[str, Callable[[PlanningProblem], Came]] = {
    "everything": _searched("portfolio"),
    "proofs": _proved,
    "cells": _explored,
    "paper": _searched("paper"),
}
