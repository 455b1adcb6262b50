"""The searches and the bisections of a campaign file: their batches, and how each of them is made."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import cached_property
from math import inf, nan
from typing import Any

import numpy as np

from coop_drake.answers.digest import content_digest
from coop_drake.campaign.batches import BREAKING, SEARCH, Batch, SearchKind
from coop_drake.campaign.plans import versions
from coop_drake.campaign.results import CampaignFolder
from coop_drake.campaign.search.bounds import BoundedDepartures
from coop_drake.campaign.search.breaking import first_lost
from coop_drake.campaign.search.findings import BreakingPoint, Finding
from coop_drake.campaign.search.multiples import SCALED, departures_at, largest_multiple
from coop_drake.campaign.search.settings import Breaking, Searches
from coop_drake.campaign.search.trials import Trials
from coop_drake.campaign.search.worst import search_worst
from coop_drake.campaign.settings import Campaign

_NO_MATTER = ("scenarios", "count", "departures", "batch", "time_limit")
"""Keys on which the result of a single search or bisection does not depend."""


def section_of(campaign: Campaign, kind: SearchKind) -> Searches | Breaking | None:
    """Return the section that asks for searches or for bisections, None where there is none."""
    return campaign.searches if kind == SEARCH else campaign.breaking


def search_batches(campaign: Campaign, folder: CampaignFolder) -> Iterator[Batch]:
    """Yield the batches of all searches and bisections of a campaign, scenario by scenario."""
    kinds: tuple[SearchKind, ...] = (SEARCH, BREAKING)
    for kind in kinds:
        if (asked := section_of(campaign, kind)) is not None:
            for scenario in range(len(asked.scenarios)):
                yield from Searching(campaign, folder, kind, scenario).batches()


class Searching:
    """The searches of one scenario, or the bisections of one departure after the other.

    Args:
        campaign: The campaign.
        folder: The folder of its results.
        kind: Whether these are searches or bisections.
        scenario: Index of the scenario in their section.
        made: Called whenever a run was made, so that others see that the process is alive.
    """

    def __init__(
        self,
        campaign: Campaign,
        folder: CampaignFolder,
        kind: SearchKind,
        scenario: int,
        made: Callable[[], None] = lambda: None,
    ) -> None:
        asked = section_of(campaign, kind)
        assert asked is not None  # or there would be no batch of this kind
        self._asked, self._kind, self._scenario, self._folder = asked, kind, scenario, folder
        self.trials = Trials(campaign, asked, asked.scenarios[scenario], folder, made)

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
        return Batch(self._scenario, self._kind, first, stop, content_digest(content))

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
