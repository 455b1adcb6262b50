"""The searches and the bisections of a study: their batches, and how each of them is made."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import cached_property, partial
from math import inf, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from benchmarks.searches.bounds import BoundedDepartures
from benchmarks.searches.breaking import first_lost
from benchmarks.searches.findings import BreakingPoint, Finding
from benchmarks.searches.multiples import SCALED, departures_at, largest_multiple
from benchmarks.searches.settings import Breaking, Searches
from benchmarks.searches.trials import Trials
from benchmarks.searches.worst import search_worst
from coop_drake.answers.digest import content_digest
from coop_drake.campaign.batches import Batch, Task, Work
from coop_drake.campaign.plans import versions
from coop_drake.campaign.results import CampaignFolder
from coop_drake.campaign.running.making import check_unchanged

if TYPE_CHECKING:
    from benchmarks.study import Study

SearchKind = Literal["search", "breaking"]
"""Searches, or bisections of departures; batches have it in place of a tier."""

_NO_MATTER = ("scenarios", "count", "departures", "batch", "time_limit")
"""Keys on which the result of a single search or bisection does not depend."""


def section_of(study: Study, kind: SearchKind) -> Searches | Breaking | None:
    """Return the section that asks for searches or for bisections, None where there is none."""
    return study.searches if kind == "search" else study.breaking


def search_batches(study: Study, folder: CampaignFolder) -> Iterator[Batch]:
    """Yield the batches of all searches and bisections of a study, scenario by scenario."""
    kinds: tuple[SearchKind, ...] = ("search", "breaking")
    for kind in kinds:
        if (asked := section_of(study, kind)) is not None:
            for scenario in range(len(asked.scenarios)):
                yield from Searching(study, folder, kind, scenario).batches()


class Searching:
    """The searches of one scenario, or the bisections of one departure after the other.

    Args:
        study: The study.
        folder: The folder of its results.
        kind: Whether these are searches or bisections.
        scenario: Index of the scenario in their section.
        made: Called whenever a run was made, so that others see that the process is alive.
    """

    def __init__(
        self,
        study: Study,
        folder: CampaignFolder,
        kind: SearchKind,
        scenario: int,
        made: Callable[[], None] = lambda: None,
    ) -> None:
        asked = section_of(study, kind)
        assert asked is not None  # or there would be no batch of this kind
        self._asked, self._kind, self._scenario, self._folder = asked, kind, scenario, folder
        self.trials = Trials(study.path, asked, asked.scenarios[scenario], folder, made)

    def batches(self) -> Iterator[Batch]:
        """Yield the batches of all of them."""
        count = len(self._asked.departures) if isinstance(self._asked, Breaking) else self._asked.count
        for first in range(0, count, self._asked.size):
            yield self.batch(first, min(first + self._asked.size, count))

    def batch(self, first: int, stop: int) -> Batch:
        """Return one batch, named by the digest of all that its results depend on."""
        which: Any = [first, stop]
        if isinstance(self._asked, Breaking):
            which = self._asked.departures[first:stop]
        content = {**self._content, "kind": self._kind, "which": which}
        work = "SEARCHES" if self._kind == "search" else "BISECTIONS"
        return Batch(self._scenario, self._kind, first, stop, content_digest(content), f"{__name__}:{work}")

    @cached_property
    def _content(self) -> dict[str, Any]:
        parts = {name: value for name, value in asdict(self._asked).items() if name not in _NO_MATTER}
        return {**parts, "plan": self.trials.digest, "versions": versions()}

    def begun(self, index: int) -> Finding | BreakingPoint:
        """Return what a search or bisection leaves if processes are lost at it."""
        asked, name = self._asked, self.trials.name
        if isinstance(asked, Breaking):
            return BreakingPoint(name, asked.tier, asked.departures[index], nan, 0.0, inf, asked.runs, "")
        return Finding(name, asked.tier, asked.seed + index, 0, asked.margin, nan, nan, arrived=False)

    def record(self, index: int) -> Finding | BreakingPoint:
        """Make a search or a bisection."""
        if isinstance(self._asked, Breaking):
            return self._broken(self._asked, index)
        return self._searched(self._asked, self._asked.seed + index)

    def _searched(self, asked: Searches, seed: int) -> Finding:
        trials = self.trials
        bounded = BoundedDepartures(trials.budget, trials.tree)
        found = search_worst(
            np.random.default_rng(seed).uniform(size=len(bounded.names)),
            lambda fractions: bounded.values(fractions, asked.factor),
            trials.run_all,
            margin=asked.margin,
            evaluations=asked.evaluations,
            seed=seed,
        )
        search = content_digest(self._content)[:8]  # Others may be of a scenario of the same name.
        file = self._folder.path / "found" / f"{trials.name}_{seed}_{search}.campaign.yaml"
        trials.write_found(found.values, file)
        return Finding(
            trials.name,
            asked.tier,
            seed,
            len(found.margins),
            asked.margin,
            float(getattr(found.first, asked.margin)),
            float(getattr(found.record, asked.margin)),
            found.record.arrived,
            found.record.reason,
            str(file.relative_to(self._folder.path)),
        )

    def _broken(self, asked: Breaking, index: int) -> BreakingPoint:
        trials, departure = self.trials, asked.departures[index]
        budget, tree = trials.budget, trials.tree

        def lost(multiple: float) -> str:
            for seed in range(asked.seed, asked.seed + asked.runs):
                (record,) = trials.run_all([departures_at(budget, tree, departure, multiple, seed)], seed)
                if not record.arrived:
                    return record.reason
            return ""

        def allowed(multiple: float) -> bool:
            return trials.allows(departures_at(budget, tree, departure, multiple, asked.seed))

        largest = largest_multiple(budget, departure, asked.largest)
        kept, upper, reason = first_lost(lost, asked.halvings, largest, allowed)
        certified = 1.0 if departure == "all" else getattr(budget, SCALED[departure][0])
        point = self.begun(index)
        assert isinstance(point, BreakingPoint)
        return replace(point, certified=certified, kept=kept, lost=upper, reason=reason)


def _tasks(order: dict[str, Any], alive: Callable[[], None]) -> Iterator[Task]:
    """Yield the searches or bisections of a batch that are to be made."""
    from benchmarks.study import load_study

    folder, batch = CampaignFolder(Path(order["folder"])), order["batch"]
    study = load_study(folder.campaign, Path(order["campaign"]))
    searching = Searching(study, folder, batch["tier"], batch["scenario"], alive)
    check_unchanged(order, searching.batch(batch["first"], batch["stop"]))
    for index in range(order["begin"], batch["stop"]):
        yield searching.begun(index), partial(searching.record, index)


SEARCHES = Work("searches", Finding, _tasks)
"""Searches for runs with small margins."""

BISECTIONS = Work("breaking", BreakingPoint, _tasks)
"""Bisections of departures."""
