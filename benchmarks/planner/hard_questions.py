"""Random questions of the campaign that were slow or undecided, kept with what makes them so."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.planner.growth import growth_rows
from benchmarks.tasks import Rows, Task
from coop_drake.campaign.questions.question import random_question
from coop_drake.campaign.questions.settings import QuestionSettings

__all__ = ["CAUSES", "hard_question_tasks"]

SETTINGS = QuestionSettings(seeds=(20261, 20262, 20263))
"""The settings of ``benchmarks/campaigns/questions.campaign.yaml`` that determine its questions."""

CAUSES = {
    4: "a corridor of 1.06 of the narrowest one, two robots: no way is sampled, 4,000 slices prove nothing",
    15: "doors of 0.89 of the narrowest corridor, two robots: no way is sampled, thousands of slices",
    22: "a door of 0.70 of the narrowest corridor, four robots: the proof takes slices of one of them",
    30: "a corridor of 0.98 of the narrowest one, four robots: no way is sampled, 4,000 slices prove nothing",
    32: "doors of 0.89 of the narrowest corridor, two robots: no way is sampled, thousands of slices",
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
