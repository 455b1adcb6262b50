"""The batches of a campaign: consecutive runs, questions or searches of one process, and of one file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal, get_args

from coop_drake.answers.digest import content_digest
from coop_drake.campaign.plans import Plans, scenario_content, versions
from coop_drake.campaign.questions.settings import QuestionSettings
from coop_drake.campaign.records import QuestionRecord, Record, RunRecord
from coop_drake.campaign.search.findings import BreakingPoint, Finding
from coop_drake.campaign.settings import Tier
from coop_drake.campaign.variation import Variation
from coop_drake.typed_data import to_plain

PLANNER: Literal["planner"] = "planner"
SEARCH: Literal["search"] = "search"
BREAKING: Literal["breaking"] = "breaking"
"""In place of a tier: the batch has planning questions, searches or bisections in place of runs."""

SearchKind = Literal["search", "breaking"]
"""Searches, or bisections of departures."""

_KINDS: dict[str, tuple[str, type[Record]]] = {
    PLANNER: ("questions", QuestionRecord),
    SEARCH: ("searches", Finding),
    BREAKING: ("breaking", BreakingPoint),
}
"""The folder and the record of what is no run."""


@dataclass(frozen=True)
class Batch:
    """Consecutive runs of one scenario in one tier, planning questions, searches, or bisections.

    Attributes:
        scenario: Index of the scenario in its section of the campaign file; 0 for questions.
        tier: By which loop runs are made; ``planner`` for questions, ``search`` for searches, ``breaking``
            for bisections.
        first: Index of the first run, question, search or departure.
        stop: Index behind the last one.
        digest: SHA-256 of all that their results depend on; names their file.
    """

    scenario: int
    tier: Tier | Literal["planner"] | SearchKind
    first: int
    stop: int
    digest: str

    @property
    def record(self) -> type[Record]:
        """What each of its runs, questions or searches leaves."""
        return _KINDS.get(self.tier, ("runs", RunRecord))[1]

    @property
    def file(self) -> Path:
        """The file of its records, in the campaign's folder."""
        return Path(_KINDS.get(self.tier, ("runs", RunRecord))[0]) / f"{self.digest}.parquet"

    @property
    def costs(self) -> Path:
        """The file that says what it took; other than the records it is never the same twice."""
        return Path("costs") / f"{self.digest}.json"


def question_batches(settings: QuestionSettings) -> Iterator[Batch]:
    """Yield all batches of planning questions."""
    for first in range(0, settings.count, settings.batch):
        yield question_batch(settings, first, min(first + settings.batch, settings.count))


def question_batch(settings: QuestionSettings, first: int, stop: int) -> Batch:
    """Return one batch of planning questions; what it leaves does not depend on how many others there are."""
    asked = to_plain(replace(settings, count=1, batch=1), QuestionSettings)
    content = {"questions": asked, "versions": versions(), "first": first, "stop": stop}
    return Batch(0, PLANNER, first, stop, content_digest(content))


class Batching:
    """Divides a campaign into batches.

    Args:
        variation: Its runs.
        plans: Their plans.
    """

    def __init__(self, variation: Variation, plans: Plans) -> None:
        self._variation, self._plans = variation, plans
        self._content = cache(self._content_of)

    def batches(self) -> Iterator[Batch]:
        """Yield all batches: Drake's first, because they take longest."""
        for tier in get_args(Tier):
            for scenario in range(len(self._variation.scenarios)):
                indices, size = self._variation.indices(scenario, tier), self._variation.runs.batch_of(tier)
                for first in range(indices.start, indices.stop, size):
                    yield self.batch(scenario, tier, first, min(first + size, indices.stop))

    def batch(self, scenario: int, tier: Tier, first: int, stop: int) -> Batch:
        """Return one batch; the arguments are those of `Batch`."""
        content = {**self._content(scenario), "tier": tier, "first": first, "stop": stop}
        if tier == "drake":
            content["blocks"] = self._variation.runs.blocks
        return Batch(scenario, tier, first, stop, content_digest(content))

    def _content_of(self, scenario: int) -> dict[str, Any]:
        """Return what the results of a scenario's runs depend on, but for their tier and indices."""
        runs = self._variation.runs
        first = self._variation.run(scenario * self._variation.runs_of_scenario)
        return {
            **scenario_content(self._variation.scenarios[scenario]),
            "plan": self._plans.digest_of(first),
            "vary": {key: repr(one) for key, one in runs.vary.items()},
            "grid": {key: list(values) for key, values in runs.grid.items()},
            "runs of a combination": runs.count if runs.grid else None,
            "seed": runs.seed,
            "keep": runs.keep,
        }
