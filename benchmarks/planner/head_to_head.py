"""Our planner, OMPL and our own bare trees on one scenario file, in one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from benchmarks.isolated import Isolated, in_own_process
from benchmarks.planner.cases import Case
from benchmarks.planner.ompl_peer import has_ompl, run_ompl
from benchmarks.planner.ours import Planned, plan_repeatedly
from benchmarks.planner.path_check import fault_of
from benchmarks.planner.peer import PeerRun
from benchmarks.planner.trees_peer import CHECKS, run_trees
from benchmarks.rows import Row
from coop_drake.planning import PlanningProblem

__all__ = ["Effort", "compare"]

_IMPASSABLE_RUNS = 2
_START_UP = 30.0
_MOST_PER_FLOOR = 20.0


@dataclass(frozen=True)
class Effort:
    """How much is spent on every case.

    Attributes:
        seeds: Runs of every peer.
        budget: CPU time of every run of OMPL [s].
        limit: CPU time of one answer of ours [s].
        repeats: Answers of ours, after the first one.
    """

    seeds: int = 10
    budget: float = 10.0
    limit: float = 60.0
    repeats: int = 3


@dataclass(frozen=True)
class _Standing:
    """What a peer came to on a case: in words, and its median with failures counted as they ended [CPU s]."""

    text: str
    seconds: float | None


def compare(case: Case, effort: Effort) -> list[Row]:
    """Measure everybody on a case.

    Peers cannot answer "no": where there is no way they run twice only, to show what they do about it.

    Args:
        case: The scenario file.
        effort: How much to spend.
    """
    problem = case.problem()
    seeds = range(1, 1 + (effort.seeds if case.passable else min(_IMPASSABLE_RUNS, effort.seeds)))
    floor, rows = _floor(case, problem, seeds)
    standings = [floor]
    if has_ompl():
        ompl, more = _ompl(case, problem, seeds, effort.budget)
        standings, rows = [floor, ompl], rows + more
    return _ours(case, problem, effort, standings) + rows


def _ours(case: Case, problem: PlanningProblem, effort: Effort, standings: Sequence[_Standing]) -> list[Row]:
    """Rows of our planner beside all peers; the last one is OMPL's, if it ran."""
    name, runs = f"planner/{case.name}", 1 + effort.repeats
    done: Isolated[tuple[Planned, ...]] = in_own_process(
        plan_repeatedly, problem, runs, limit=runs * effort.limit
    )
    if done.value is None:
        return [Row(f"{name}/answer", 0.0, f"none within {effort.limit:g} CPU s")]
    cold, *warm = done.value
    first = median(run.first_plan_cpu_seconds for run in warm)
    floor, peer = standings[0], standings[-1]
    memory = [] if done.peak_mb is None else [Row(f"{name}/peak_memory", done.peak_mb, "MB")]
    return [
        Row(f"{name}/answer", float(cold.answer != "undecided"), cold.answer),
        Row(f"{name}/first_plan_cpu_seconds", first, "s", peer.text, peer.seconds),
        Row(f"{name}/first_plan_beside_floor", first, "s", floor.text, floor.seconds),
        Row(f"{name}/cpu_seconds", median(r.cpu_seconds for r in warm), "s", peer.text, peer.seconds),
        Row(f"{name}/cold_cpu_seconds", cold.cpu_seconds, "s"),
        *memory,
        Row(f"{name}/slices", cold.slices, "slices"),
        Row(f"{name}/cells", cold.cells, "cells"),
        Row(f"{name}/margin", 1e3 * cold.margin_m, "mm"),
        Row(f"{name}/transport", cold.transport_seconds, "s"),
    ]


def _floor(case: Case, problem: PlanningProblem, seeds: Sequence[int]) -> tuple[_Standing, list[Row]]:
    limit = _START_UP + _MOST_PER_FLOOR * len(seeds)
    runs = in_own_process(run_trees, problem, tuple(seeds), limit=limit).value or ()
    allowed = f"{CHECKS:,} checks"
    return _judged(f"planner/rrt_connect/{case.name}", "own RRT-Connect", problem, runs, allowed)


def _ompl(
    case: Case, problem: PlanningProblem, seeds: Sequence[int], budget: float
) -> tuple[_Standing, list[Row]]:
    limit = _START_UP + (budget + 1.0) * len(seeds)
    runs = in_own_process(run_ompl, problem, tuple(seeds), budget, limit=limit).value or ()
    name = f"planner/ompl/{case.name}"
    standing, rows = _judged(name, "OMPL RRT-Connect", problem, runs, f"{budget:g} CPU s")
    if not runs:
        return standing, rows
    checks = median(run.checks for run in runs)
    share = median((run.check_seconds or 0.0) / run.cpu_seconds for run in runs)
    return standing, [
        *rows,
        Row(f"{name}/checks", checks, "checks"),
        Row(f"{name}/check_share", share, "of time"),
    ]


def _judged(
    name: str, peer: str, problem: PlanningProblem, runs: Sequence[PeerRun], allowed: str
) -> tuple[_Standing, list[Row]]:
    """Rows of a peer; a path counts only if it stands the dense check."""
    claims = [run for run in runs if run.found]
    good = [run for run in claims if not fault_of(problem, run.path)]
    wrong = len(claims) - len(good)
    count = [Row(f"{name}/found", len(good), f"of {len(runs)}"), Row(f"{name}/wrong", wrong, "paths")]
    if not good:
        return _Standing(f"{peer}: no path in {len(runs)} runs of {allowed}", None), count
    middle = median(run.cpu_seconds for run in runs)
    times = [run.cpu_seconds for run in good]
    text = f"{peer}: median of {len(runs)}, {len(good)} found within {allowed}"
    return _Standing(text, middle), [
        Row(f"{name}/cpu_seconds", middle, "s"),
        Row(f"{name}/fastest", min(times), "s"),
        Row(f"{name}/slowest", max(times), "s"),
        *count,
    ]
