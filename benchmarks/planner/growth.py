"""How time, slices, cells and memory grow with corridors, robots, joints and walls."""

from __future__ import annotations

from benchmarks.isolated import in_own_process
from benchmarks.planner.family import corridor_problem, crowd_problem, shelf_problem
from benchmarks.planner.ours import plan_once_warm
from benchmarks.rows import Row
from benchmarks.tasks import Task
from coop_drake.answers import PlanningProblem

__all__ = ["growth_rows", "growth_tasks"]

WIDTHS = (1.2, 1.0, 0.9, 0.85, 0.82, 0.8, 0.79, 0.78, 0.77)
"""Widths of the corridor, down to one that is proved too narrow [m]."""

ROBOTS = (2, 3, 4, 5, 6)
"""Robots that carry the hexagon."""

JOINTS = (1, 2, 3)
"""Joints of each of two arms."""

VERTICES = (50, 500, 5_000, 50_000)
"""Corners of a floor with shelves, about."""


def growth_tasks(limit: float) -> list[Task]:
    """One task for every question.

    Args:
        limit: CPU time that each may take [s].
    """
    questions: dict[str, PlanningProblem] = {}
    for width in WIDTHS:
        questions[f"width/{width:g}"] = corridor_problem(width)
    for robots in ROBOTS:
        questions[f"robots/{robots}"] = crowd_problem(robots)
    for joints in JOINTS:
        questions[f"joints/{joints}"] = corridor_problem(joints_per_arm=joints)
    for vertices in VERTICES:
        questions[f"vertices/{vertices}"] = shelf_problem(vertices)
    return [_task(f"planner/growth/{what}", problem, limit) for what, problem in questions.items()]


def _task(name: str, problem: PlanningProblem, limit: float) -> Task:
    return Task(name, lambda rows: growth_rows(name, problem, limit))


def growth_rows(name: str, problem: PlanningProblem, limit: float) -> list[Row]:
    """Plan once in a process of its own, with the kernels loaded, and measure time, slices, cells and memory.

    Args:
        name: What the rows' names begin with.
        problem: The question.
        limit: CPU time it may take [s]; with what comes before it is a little less.
    """
    done = in_own_process(plan_once_warm, problem, limit=limit)
    memory = [] if done.peak_mb is None else [Row(f"{name}/peak_memory", done.peak_mb, "MB")]
    planned = done.value
    if planned is None:
        return [Row(f"{name}/answer", 0.0, f"none within {limit:g} CPU s"), *memory]
    return [
        Row(f"{name}/answer", float(planned.answer != "undecided"), planned.answer),
        Row(f"{name}/first_plan_cpu_seconds", planned.first_plan_cpu_seconds, "s"),
        Row(f"{name}/cpu_seconds", planned.cpu_seconds, "s"),
        Row(f"{name}/slices", planned.slices, "slices"),
        Row(f"{name}/cells", planned.cells, "cells"),
        *memory,
    ]
