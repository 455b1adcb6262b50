"""Our planner, OMPL, Drake's GCS and a compiled RRT-Connect on the same scenario files, in one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from benchmarks.isolated import in_own_process
from benchmarks.planner.cases import CASES, Case
from benchmarks.planner.gcs_peer import run_gcs
from benchmarks.planner.ours import plan_repeatedly
from benchmarks.questions.peers import CHECKS, PeerRun, fault_of, has_ompl, run_compiled_ompl, run_trees
from benchmarks.rows import Row
from benchmarks.tasks import Rows, Task
from coop_drake.answers import PlanningProblem

IMPASSABLE_RUNS = 2
"""Runs of other planners on a question without a path: they cannot answer it and use all their time."""

START_UP = 60.0
"""CPU time that a process may take before it searches: imports and compiling [s]."""

MOST_PER_RUN = 20.0
"""CPU time of one run of the compiled trees [s]."""

GCS_CASES = ("base", "elbow")
"""Scenes on which Drake's own planner is measured: it takes minutes for each."""

REGION_LIMIT = 300.0
"""CPU time after which it begins no further region [s]."""

PATIENCE = 5.0
"""An answer that took longer is not repeated [CPU s]."""


@dataclass(frozen=True)
class Effort:
    """Effort for every case.

    Attributes:
        seeds: Runs of every peer.
        budget: CPU time of every run of OMPL [s].
        limit: CPU time of one answer of ours [s].
        repeats: Answers of ours, after the first one.
    """

    seeds: int = 10
    budget: float = 8.0
    limit: float = 20.0
    repeats: int = 3


def head_to_head_tasks(effort: Effort) -> list[Task]:
    """For every case a task for each other planner, then a task for ours.

    The others cannot answer "infeasible"; on questions without a path they run only twice, to show what they
    return.

    Args:
        effort: The effort.
    """
    tasks = []
    for case in CASES:
        seeds = range(1, 1 + (effort.seeds if case.passable else min(IMPASSABLE_RUNS, effort.seeds)))
        tasks.append(_trees_task(case, seeds))
        if has_ompl():
            tasks.append(_ompl_task(case, seeds, effort.budget))
        if case.name in GCS_CASES:
            tasks.append(_gcs_task(case))
        tasks.append(_our_task(case, effort))
    return tasks


def _trees_task(case: Case, seeds: Sequence[int]) -> Task:
    name = f"planner/rrt_connect/{case.name}"

    def measure(rows: Rows) -> Rows:
        problem = case.problem()
        limit = START_UP + MOST_PER_RUN * len(seeds)
        runs = in_own_process(run_trees, problem, tuple(seeds), limit=limit).value or ()
        return judged(name, problem, runs, f"{CHECKS:,} checks")

    return Task(name, measure)


def _ompl_task(case: Case, seeds: Sequence[int], budget: float) -> Task:
    name = f"planner/ompl/{case.name}"

    def measure(rows: Rows) -> Rows:
        problem = case.problem()
        limit = START_UP + (budget + 1.0) * len(seeds)
        runs = in_own_process(run_compiled_ompl, problem, tuple(seeds), budget, limit=limit).value or ()
        shares = [run.check_seconds / run.cpu_seconds for run in runs if run.check_seconds is not None]
        share = [Row(f"{name}/check_share", median(shares), "of time")] if shares else []
        return [*judged(name, problem, runs, f"{budget:g} CPU s"), *share]

    return Task(name, measure)


def _gcs_task(case: Case) -> Task:
    name = f"planner/gcs/{case.name}"

    def measure(rows: Rows) -> Rows:
        problem = case.problem()
        run = in_own_process(run_gcs, problem, REGION_LIMIT, limit=START_UP + 2.0 * REGION_LIMIT).value
        if run is None:
            return [Row(f"{name}/found", 0.0, f"of 1 within {REGION_LIMIT:g} CPU s for regions")]
        fault = fault_of(problem, run.path) if len(run.path) else "none"
        return [
            Row(f"{name}/found", float(not fault), f"of 1 within {REGION_LIMIT:g} CPU s for regions"),
            Row(f"{name}/wrong", float(len(run.path) > 0 and bool(fault)), "paths"),
            Row(f"{name}/cpu_seconds", run.region_seconds + run.solve_seconds, "s"),
            Row(f"{name}/regions", run.regions, "regions"),
            Row(f"{name}/region_seconds", run.region_seconds, "s"),
        ]

    return Task(name, measure)


def judged(name: str, problem: PlanningProblem, runs: Sequence[PeerRun], allowed: str) -> list[Row]:
    """Rows of another planner; a path counts only if it passes the dense check.

    The median time is over all runs, also those without a path; if no run found a path there is no median.

    Args:
        name: What the rows' names begin with.
        problem: The question.
        runs: Its runs; none if its process reached the limit.
        allowed: What each run might spend, in words.
    """
    claims = [run for run in runs if run.found]
    good = [run for run in claims if not fault_of(problem, run.path)]
    count = [
        Row(f"{name}/found", len(good), f"of {len(runs)} within {allowed}"),
        Row(f"{name}/wrong", len(claims) - len(good), "paths"),
    ]
    if not good:
        return count
    times = [run.cpu_seconds for run in good]
    return [
        *count,
        Row(f"{name}/cpu_seconds", median(run.cpu_seconds for run in runs), "s"),
        Row(f"{name}/fastest", min(times), "s"),
        Row(f"{name}/slowest", max(times), "s"),
        Row(f"{name}/checks", median(run.checks for run in runs), "checks"),
    ]


def _our_task(case: Case, effort: Effort) -> Task:
    name, runs = f"planner/{case.name}", 1 + effort.repeats

    def measure(rows: Rows) -> Rows:
        limit = effort.limit + runs * PATIENCE
        done = in_own_process(plan_repeatedly, case.problem(), runs, PATIENCE, limit=limit)
        if done.value is None:
            return [Row(f"{name}/answer", 0.0, f"none within {limit:g} CPU s")]
        cold, *warm = done.value
        warm = warm or [cold]
        first = median(run.first_plan_cpu_seconds for run in warm)
        total = median(run.cpu_seconds for run in warm)
        trees, ompl = (_standing(peer, case, rows) for peer in ("rrt_connect", "ompl"))
        memory = [] if done.peak_mb is None else [Row(f"{name}/peak_memory", done.peak_mb, "MB")]
        return [
            Row(f"{name}/answer", float(cold.answer != "undecided"), cold.answer),
            Row(f"{name}/first_plan_cpu_seconds", first, "s", *ompl),
            Row(f"{name}/first_plan_beside_rrt_connect", first, "s", *trees),
            Row(f"{name}/cpu_seconds", total, "s", *ompl),
            Row(f"{name}/cold_cpu_seconds", cold.cpu_seconds, "s"),
            *memory,
            Row(f"{name}/slices", cold.slices, "slices"),
            Row(f"{name}/cells", cold.cells, "cells"),
            Row(f"{name}/narrowest passage", 1e3 * cold.neck_m, "mm"),
            Row(f"{name}/transport", cold.transport_seconds, "s"),
        ]

    return Task(name, measure, alone=True)


def _standing(peer: str, case: Case, rows: Rows) -> tuple[str, float | None]:
    """The result of another planner on a case, in words and as its median CPU time [s]."""
    figures = {row.figure: row for row in rows if row.name.startswith(f"planner/{peer}/{case.name}/")}
    if "found" not in figures:
        return "", None
    found, seconds = figures["found"], figures.get("cpu_seconds")
    return f"{peer}: {found.value:g} found {found.unit}", None if seconds is None else seconds.value
