"""Teams of five and six robots, and of three with three joints each, where passages are narrow for them."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.planner.family import corridor_problem, crowd_problem
from benchmarks.planner.growth import growth_rows
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake.answers import PlanningProblem

__all__ = ["CRITICAL", "team_tasks"]

CRITICAL: dict[str, tuple[float, Callable[[float], PlanningProblem]]] = {
    "five": (1.45, lambda width: crowd_problem(5, width, width)),
    "six": (1.55, lambda width: crowd_problem(6, width, width)),
    "three joints": (1.0, lambda width: corridor_problem(width, width, 3, 3)),
}
"""Questions by the width of corridor and door, and the smallest width for which the planner has found a plan
within ten seconds of processor time [m]: an upper bound of the critical width."""

FACTORS = (1.3, 1.15, 1.0)
"""Widths over the critical one [-]."""

FIRST_PLAN = 2.0
"""Time within which there shall be a first certified plan at the largest of these widths [CPU s]."""

MEMORY = 500.0
"""Memory that a plan may take [MB]."""


def team_tasks(limit: float) -> list[Task]:
    """One task for each team and width.

    Args:
        limit: CPU time that each may take [s].
    """
    return [
        _task(f"planner/teams/{team} at {factor:g}", make(factor * critical), limit, factor)
        for team, (critical, make) in CRITICAL.items()
        for factor in FACTORS
    ]


def _task(name: str, problem: PlanningProblem, limit: float, factor: float) -> Task:
    return Task(name, lambda rows: [_beside(row, factor) for row in growth_rows(name, problem, limit)])


def _beside(row: Row, factor: float) -> Row:
    """The row beside its limit, if it has one."""
    if row.figure == "peak_memory":
        return Row(row.name, row.value, row.unit, "limit", MEMORY)
    if row.figure == "first_plan_cpu_seconds" and factor == max(FACTORS):
        return Row(row.name, row.value, row.unit, "limit", FIRST_PLAN)
    return row
