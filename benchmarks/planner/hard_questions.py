"""Random questions of the campaign that were slow or undecided, kept with what makes them so."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.planner.growth import growth_rows
from benchmarks.questions.question import random_question
from benchmarks.questions.settings import QuestionSettings
from benchmarks.tasks import Rows, Task

__all__ = ["CAUSES", "hard_question_tasks"]

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
    return [_task(number, limit) for number in CAUSES]


def _task(number: int, limit: float) -> Task:
    name = f"planner/hard_questions/{SETTINGS.seed(number)}_{number}"

    def measure(rows: Rows) -> Rows:
        with TemporaryDirectory() as folder:
            problem = random_question(SETTINGS, number, Path(folder)).problem
        return growth_rows(name, problem, limit)

    return Task(name, measure)
