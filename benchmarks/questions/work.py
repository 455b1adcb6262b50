"""Questions as work of processes: their batches, and how each question is answered."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.questions.answering import ask, begun_question
from benchmarks.questions.record import QuestionRecord
from benchmarks.questions.settings import QuestionSettings
from coop_drake.answers.digest import content_digest
from coop_drake.campaign.batches import Batch, Task, Work
from coop_drake.campaign.plans import versions
from coop_drake.campaign.results import CampaignFolder
from coop_drake.planning import warm_up
from coop_drake.typed_data import to_plain

CASES = "cases"
"""Folder of questions that were answered wrongly or not at all, in that of the results."""


def question_batches(settings: QuestionSettings) -> Iterator[Batch]:
    """Yield all batches of questions; what one leaves does not depend on how many others there are."""
    asked = to_plain(replace(settings, count=1, batch=1), QuestionSettings)
    for first in range(0, settings.count, settings.batch):
        stop = min(first + settings.batch, settings.count)
        content = {"questions": asked, "versions": versions(), "first": first, "stop": stop}
        yield Batch(0, "planner", first, stop, content_digest(content), f"{__name__}:QUESTIONS")


def _tasks(order: dict[str, Any], alive: Callable[[], None]) -> Iterator[Task]:
    """Yield the questions of a batch that are to be answered; kernels are loaded before their time counts."""
    from benchmarks.study import load_study

    folder = CampaignFolder(Path(order["folder"]))
    settings = load_study(folder.campaign, Path(order["campaign"])).questions
    assert settings is not None  # or there would be no batches
    warm_up.main()
    for number in range(order["begin"], order["batch"]["stop"]):
        yield begun_question(settings, number), partial(ask, number, settings, folder.path / CASES)


QUESTIONS = Work("questions", QuestionRecord, _tasks)
"""Planning questions."""
