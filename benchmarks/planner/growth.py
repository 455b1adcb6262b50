"""Questions of growing size, of larger teams and hard ones: what planning takes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.isolated import in_own_process
from benchmarks.planner.family import corridor_problem, crowd_problem, shelf_problem
from benchmarks.planner.ours import plan_once_warm
from benchmarks.questions.question import random_question
from benchmarks.questions.settings import QuestionSettings
from benchmarks.rows import Row
from benchmarks.tasks import Rows, Task
from coop_drake.answers import PlanningProblem

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
        _team_task(f"planner/teams/{team} at {factor:g}", make(factor * critical), limit, factor)
        for team, (critical, make) in CRITICAL.items()
        for factor in FACTORS
    ]


def _team_task(name: str, problem: PlanningProblem, limit: float, factor: float) -> Task:
    return Task(name, lambda rows: [_beside(row, factor) for row in growth_rows(name, problem, limit)])


def _beside(row: Row, factor: float) -> Row:
    """The row beside its limit, if it has one."""
    if row.figure == "peak_memory":
        return Row(row.name, row.value, row.unit, "limit", MEMORY)
    if row.figure == "first_plan_cpu_seconds" and factor == max(FACTORS):
        return Row(row.name, row.value, row.unit, "limit", FIRST_PLAN)
    return row


SETTINGS = QuestionSettings(seeds=(20261, 20262, 20263))
"""The settings of ``benchmarks/campaigns/questions.study.yaml`` that determine its questions."""

CAUSES = {
    4: "a corridor of 1.06 of the narrowest one, two robots: a way is certified that is narrower than the "
    "limits allow",
    15: "doors of 0.89 of the narrowest corridor, two robots: no way is sampled, thousands of slices",
    22: "a door of 0.70 of the narrowest corridor, four robots: the proof takes slices of one of them",
    30: "a corridor of 0.98 of the narrowest one, four robots: no way is sampled, 4,000 slices prove nothing",
    32: "doors of 0.89 of the narrowest corridor, two robots: no way is sampled, thousands of slices",
    46: "a corridor of 1.14 of the narrowest one with a bend, two robots: it is proved that no path keeps "
    "0.04 m from the walls, no way is sampled",
    80: "a door of 0.60 of the narrowest corridor, 16 mm wider than the largest base: the object alone "
    "takes thousands of slices",
    106: "a door of 1.49 of the narrowest corridor, two robots with a joint each: the proof takes hundreds "
    "of slices of one of them, and meanwhile paths are sampled",
    123: "a door of 0.68 of the narrowest corridor, 20 mm wider than the largest base: the object alone "
    "takes thousands of slices",
    137: "a corridor of 0.95 of the narrowest one, three robots: a way is certified that is a tenth of a "
    "millimetre wide",
    204: "a door of 1.22 of the narrowest corridor, four robots: the proof takes thousands of slices of one "
    "of them, and meanwhile paths are sampled",
    291: "a corridor of 1.00 of the narrowest one, two robots: it is proved that no path keeps 0.04 m from "
    "the walls, no way is sampled",
    315: "a corridor of 1.12 of the narrowest one, two robots with two joints each: it is proved that no "
    "path keeps 0.01 m from the walls, no way is sampled",
    337: "a corridor of 0.93 of the narrowest one, two robots: no way is sampled, 6,000 slices prove nothing",
    409: "a corridor of 1.11 of the narrowest one, four robots with seven joints: the way that is certified "
    "is 2 mm wide for some metres",
    475: "doors of 0.96 of the narrowest corridor, two robots: no way is sampled; the graph of cells has one "
    "through passages that are narrower than a tenth of a millimetre",
    1723: "aisles of 1.20 of the narrowest corridor among 212 corners, two robots with three joints: no way "
    "is sampled, 5,000 slices prove nothing; other planners find a path in half a minute",
    2129: "aisles of 1.24 of the narrowest corridor, two robots: a way is certified that is narrower than "
    "the limits allow; the choice of its boxes and the tidying of its cells take a minute",
}
"""Why a question takes long, by its number."""


def hard_question_tasks(limit: float) -> list[Task]:
    """One task for every question.

    Args:
        limit: CPU time that each may take [s].
    """
    return [_hard_task(number, limit) for number in CAUSES]


def _hard_task(number: int, limit: float) -> Task:
    name = f"planner/hard_questions/{SETTINGS.seed(number)}_{number}"

    def measure(rows: Rows) -> Rows:
        with TemporaryDirectory() as folder:
            problem = random_question(SETTINGS, number, Path(folder)).problem
        return growth_rows(name, problem, limit)

    return Task(name, measure)
