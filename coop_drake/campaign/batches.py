"""The batches of a campaign: consecutive pieces of work, such as runs, of one process and of one file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, get_args

from coop_drake.answers.digest import content_digest
from coop_drake.campaign.plans import Plans, scenario_content
from coop_drake.campaign.records import Record, RunRecord
from coop_drake.campaign.settings import Tier
from coop_drake.campaign.variation import Variation

Task = tuple[Record, Callable[[], Record]]
"""The record of a piece of work while it is done, and what does it."""


@dataclass(frozen=True)
class Work:
    """A kind of work that processes do batch by batch; programs may have kinds of their own.

    Attributes:
        folder: Name of the folder of its files, in that of the results.
        record: What each piece of it leaves: a frozen dataclass of numbers and texts with a ``reason``.
        tasks: Where a function returns the pieces that an order asks for, an iterator of `Task`, as
            ``module:name``; only the process that does the work imports it. It is given the fields of
            `Order`, with ``begin`` for the index of the first piece, and what is to be called now and then in
            pieces that take long.
    """

    folder: str
    record: type[Record]
    tasks: str


RUNS = Work("runs", RunRecord, "coop_drake.campaign.running.making:tasks")
"""The work of which campaigns consist: runs of transports."""


@dataclass(frozen=True)
class Batch:
    """Consecutive runs of one scenario in one tier, or pieces of other work.

    Attributes:
        scenario: Index of the scenario in its section of the file; 0 for work without any.
        tier: By which loop runs are made; a name for other work.
        first: Index of the first run or piece.
        stop: Index behind the last one.
        digest: SHA-256 of all that their results depend on; names their file.
        work: Where the `Work` is, as ``module:name``.
    """

    scenario: int
    tier: str
    first: int
    stop: int
    digest: str
    work: str = f"{__name__}:RUNS"

    @property
    def record(self) -> type[Record]:
        """What each of its runs or pieces leaves."""
        return work_of(self.work).record

    @property
    def file(self) -> Path:
        """The file of its records, in the folder of the results."""
        return Path(work_of(self.work).folder) / f"{self.digest}.parquet"

    @property
    def costs(self) -> Path:
        """The file that says what it took; other than the records it is never the same twice."""
        return Path("costs") / f"{self.digest}.json"


def work_of(name: str) -> Work:
    """Return a kind of work by its place, as ``module:name``."""
    found: Work = resolve_name(name)
    return found


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
