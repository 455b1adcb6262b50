"""The searches and the bisections of a study: their batches, and how each of them is made."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, partial
from math import inf, isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import yaml

from benchmarks.searches.departures import SCALED, BoundedDepartures, departures_at, largest_multiple
from benchmarks.searches.findings import BreakingPoint, Finding
from coop_drake.answers.budget import Budget
from coop_drake.answers.document import content_digest
from coop_drake.campaign.file import LARGEST_SEED, Campaign, Count, Plain, Runs, Seed, check_keys
from coop_drake.campaign.plans import Plans, versions
from coop_drake.campaign.records import Batch, CampaignFolder, RunRecord, Task, Work
from coop_drake.campaign.runs import RunMaker, check_unchanged
from coop_drake.campaign.variation import Run, Variation
from coop_drake.errors import ScenarioError
from coop_drake.files import write_atomically
from coop_drake.plant import planning_problem
from coop_drake.tree import ComponentTree
from coop_drake.tree.arrays import FloatArray
from coop_drake.tuning.search import evolution_strategy
from coop_drake.typed_data import LARGEST, DataError, Limits, Positive

if TYPE_CHECKING:
    from benchmarks.study import Study


Margin = Literal["funnel_margin", "cell_margin", "wall_clearance", "body_clearance", "budget_share"]
"""A column of the runs that a search drives down; the share of what the budget states it drives up."""

DepartureName = Literal["delay", "lag", "angles", "rates", "position", "model", "reports", "all"]
"""A departure that is multiplied."""


def _check_names(key: str, names: Sequence[str]) -> None:
    """Refuse a list without names, or with one twice, whose results could not be told apart.

    Raises:
        DataError: With the key and what is allowed there.
    """
    if not names or len(set(names)) < len(names):
        raise DataError(key, list(names), f"at least one of the {key}, each of them once")


@dataclass(frozen=True)
class Searches:
    """Searches for departures inside the budget of a plan with which a margin becomes as small as possible.

    Normal noise and losses are off, because no number bounds them; errors of measurements are square waves
    within the budget's bounds, which together with the model's error, delay, lag and the age of reports an
    optimiser chooses (CMA-ES).

    Attributes:
        scenarios: Scenario files, relative to the campaign file, or names of shipped scenarios.
        count: Searches for every scenario, each with a seed of its own.
        evaluations: Largest number of runs of a search; a lost run ends it.
        set: Values of keys of the scenario in every run and in the plan, by their dotted keys.
        budget: Under which budget the plans must provably hold, as ``plan --budget`` takes it, a file
            relative to the campaign file if it is there; null for what every scenario requires.
        factor: How many times the budget departures may be; 1 for departures inside it [-].
        margin: The margin that is driven down; ``budget_share`` is driven up.
        seed: Seed of the first search; the others have those after it.
        tier: Which loop simulates the runs.
        batch: Searches that one process makes, and one file holds; null for 1 with Drake's loop, of which
            every run leaves some memory behind, and 10 with the compiled one.
        time_limit: Longest that a process may take for each run of a search; for the first one ten minutes
            more, in which it starts and may compile kernels [s].
    """

    scenarios: tuple[str, ...]
    count: Count = 1
    evaluations: Count = 200
    set: dict[str, Plain] = field(default_factory=dict)
    budget: str | None = None
    factor: Positive = 1.0
    margin: Margin = "funnel_margin"
    seed: Seed = 0
    tier: Literal["drake", "compiled"] = "drake"
    batch: Count | None = None
    time_limit: Positive = 120.0

    @property
    def size(self) -> int:
        """Searches of a batch."""
        return self.batch or {"drake": 1, "compiled": 10}[self.tier]

    def __post_init__(self) -> None:
        _check_names("scenarios", self.scenarios)
        if self.seed + self.count > LARGEST_SEED + 1:
            allowed = f"a seed of at most {LARGEST_SEED + 1 - self.count}, so that every search has one"
            raise DataError("seed", self.seed, allowed)
        check_keys(self.set)


@dataclass(frozen=True)
class Breaking:
    """How many times the budget of a plan each departure may be until a run is lost, by bisection.

    Errors of measurements are square waves with periods and signs drawn for every run. Those of one kind act
    alone, with the delay and the lag of the budget; longer delays and lags come with all errors of it.

    Attributes:
        scenarios: Scenario files, relative to the campaign file, or names of shipped scenarios.
        departures: What is multiplied, one after the other: ``angles``, ``rates`` and ``position`` for errors
            of measurements, ``model`` for the model's error, ``reports`` for the age of reports, ``all`` for
            all errors.
        runs: Runs at every multiple.
        halvings: How often the interval between a multiple that loses runs and one that does not is halved.
        largest: Multiples beyond this are not tried [-].
        set: Values of keys of the scenario in every run and in the plan, by their dotted keys.
        budget: Under which budget the plans must provably hold, as ``plan --budget`` takes it, a file
            relative to the campaign file if it is there; null for what every scenario requires.
        seed: Seed of periods and signs.
        tier: Which loop simulates the runs.
        time_limit: As for searches [s].
    """

    scenarios: tuple[str, ...]
    departures: tuple[DepartureName, ...] = (
        "delay", "lag", "angles", "rates", "position", "model", "reports", "all",
    )  # fmt: skip
    runs: Count = 10
    halvings: Count = 5
    largest: Annotated[float, Limits(at_least=1.0)] = 64.0
    set: dict[str, Plain] = field(default_factory=dict)
    budget: str | None = None
    seed: Seed = 0
    tier: Literal["drake", "compiled"] = "drake"
    time_limit: Positive = 120.0

    @property
    def size(self) -> int:
        """Departures of a batch; each takes some minutes."""
        return 1

    def __post_init__(self) -> None:
        _check_names("scenarios", self.scenarios)
        _check_names("departures", self.departures)
        if self.seed + self.runs > LARGEST + 1:
            allowed = f"a seed of at most {LARGEST + 1 - self.runs:.0f}, so that every run has one"
            raise DataError("seed", self.seed, allowed)
        check_keys(self.set)


LARGEST_MULTIPLE = 64.0
"""Multiples beyond this are not tried [-]: no departure is certified with so little of what a loop bears."""


def first_lost(
    lost: Callable[[float], str],
    halvings: int,
    largest: float = LARGEST_MULTIPLE,
    allowed: Callable[[float], bool] = lambda multiple: True,
) -> tuple[float, float, str]:
    """Return the largest multiple tried at which no run was lost, the smallest one at which one was, and why.

    Multiples are doubled from 1 until a run is lost, and halved while one is; then the interval is bisected.
    That is sound where larger departures lose runs that smaller ones lose, which is not always so: the
    result is a multiple at which a run was lost next to one at which none was.

    Args:
        lost: Simulates runs at a multiple, and returns why the first of them was lost; empty if none was.
        halvings: How often the interval is halved.
        largest: Multiples beyond this are not tried [-].
        allowed: Whether a multiple can be simulated; from the first one on that cannot none is tried.
    """
    kept, upper, reason, multiple = 0.0, inf, "", 1.0
    while upper == inf and multiple <= largest and allowed(multiple):
        if why := lost(multiple):
            upper, reason = multiple, why
        else:
            kept, multiple = multiple, 2.0 * multiple
    for _ in range(halvings if upper < inf else 0):
        middle = 0.5 * (kept + upper)
        if why := lost(middle):
            upper, reason = middle, why
        else:
            kept = middle
    return kept, upper, reason


Values = Mapping[str, Any]
"""Keys of a scenario with their values."""

_FIRST_STEP = 0.3
"""Standard deviation of the first generation, as a fraction of every number's range [-]: nothing is known of
where the worst departures are."""


@dataclass(frozen=True)
class Worst:
    """What a search found.

    Attributes:
        margins: The margin of every run in the order of the search; infinite where a run does not tell it.
        values: The departures of a lost run if there is one, else those of the run with the smallest margin.
        record: The record of this run.
        first: The record of the first run.
    """

    margins: tuple[float, ...]
    values: Values
    record: RunRecord
    first: RunRecord


def margin_of(record: RunRecord, name: str) -> float:
    """Return the margin of a run that a search drives down; infinite where the run does not tell it.

    ``budget_share`` counts as what is left of the budget's stated distance.
    """
    value = float(getattr(record, name))
    margin = 1.0 - value if name == "budget_share" else value
    return margin if isfinite(margin) else np.inf


def search_worst(
    start: FloatArray,
    values_of: Callable[[FloatArray], Values],
    run_all: Callable[[Sequence[Values]], Sequence[RunRecord]],
    *,
    margin: str,
    evaluations: int,
    seed: int,
    progress: Callable[[str, float], None] | None = None,
) -> Worst:
    """Search departures with which a margin becomes as small as possible.

    A lost run ends the search. The result depends on the seed and the number of runs alone.

    Args:
        start: Numbers between 0 and 1 around which the search begins.
        values_of: Returns the departures that such numbers stand for.
        run_all: Simulates runs with departures, and returns their records in the same order.
        margin: Name of the record's column that is driven down.
        evaluations: Largest number of runs.
        seed: Seed of the search.
        progress: Called with the smallest margin so far and the fraction of the runs that are done.

    Raises:
        TuningError: The package ``cma`` is not installed.
    """
    strategy = evolution_strategy(start, evaluations, seed, first_step=_FIRST_STEP)
    first = values_of(start)
    (record,) = run_all([first])
    found = Worst((margin_of(record, margin),), first, record, record)
    while found.record.arrived and len(found.margins) < evaluations and not strategy.stop():
        asked = strategy.ask()[: evaluations - len(found.margins)]
        chosen = [values_of(fractions) for fractions in asked]
        records = run_all(chosen)
        margins = [margin_of(record, margin) for record in records]
        if len(margins) == strategy.popsize:
            strategy.tell(asked, margins)
        found = _worse(found, chosen, records, margins)
        if progress is not None:
            text = f"smallest {margin.replace('_', ' ')} {min(found.margins):.4g}"
            progress(text, len(found.margins) / evaluations)
    return found


def _worse(
    found: Worst, chosen: Sequence[Values], records: Sequence[RunRecord], margins: Sequence[float]
) -> Worst:
    """Add runs to what was found. Any lost run is worse than all that arrived, whatever their margins."""
    ranks = [(record.arrived, margin) for record, margin in zip(records, margins, strict=True)]
    worst = min(range(len(ranks)), key=ranks.__getitem__)
    all_margins = (*found.margins, *margins)
    if ranks[worst] < (found.record.arrived, min(found.margins)):
        return Worst(all_margins, chosen[worst], records[worst], found.first)
    return replace(found, margins=all_margins)


class Trials:
    """Makes runs of one scenario, all along the plan that its budget asks for.

    Args:
        file: The file of the study, against which the name of the scenario is resolved.
        asked: The section that asks for the runs.
        scenario: Name of the scenario, one of the section's.
        folder: The folder of the results, with the plans.
        made: Called whenever a run was made.
    """

    def __init__(
        self,
        file: Path,
        asked: Searches | Breaking,
        scenario: str,
        folder: CampaignFolder,
        made: Callable[[], None],
    ) -> None:
        from benchmarks.searches.searching import Searches

        self._section = Runs((scenario,), 1, set=asked.set, budget=asked.budget, tier=asked.tier)
        self._file, self._name, self._made = file, scenario, made
        self._where = "searches" if isinstance(asked, Searches) else "breaking"
        self._asked = asked
        self.variation = Variation(Campaign(runs=self._section, path=file), self._where)
        _ = self.variation.scenarios  # What set says is checked.
        self._plans = Plans(self.variation, folder.plans)
        self._maker = RunMaker(self.variation, self._plans, asked.tier, folder.path / "logs")

    def check(self) -> None:
        """Refuse departures that the scenario does not allow, and what the loop does not know.

        Raises:
            PlanError: There is no plan.
            ScenarioError: The plan has no budget, a factor is too large, or the loop does not know the runs.
        """
        self._maker.check_run(self.variation.run(0))
        bounded, factor = BoundedDepartures(self.budget, self.tree), 1.0
        key, value, what = "breaking.budget", self._asked.budget, "a budget whose"
        if isinstance(self._asked, Searches):
            factor = self._asked.factor
            key, value, what = "searches.factor", f"{factor:g}", "a number of times the budget at which all"
        for share in (0.0, 1.0):
            try:
                chosen = bounded.values(np.full(len(bounded.names), share), factor)
                self.variation.scenario_of(Run(0, 0, 0, chosen))
            except DataError as error:
                allowed = f"{what} departures can be simulated ({error})"
                raise ScenarioError(str(self._file), key, value, allowed) from error

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.variation.scenarios[0].name

    @cached_property
    def budget(self) -> Budget:
        """The budget that the plan states.

        Raises:
            PlanError: There is no plan.
            ScenarioError: The plan has no budget.
        """
        plan, _ = self._plans.with_maps(self.variation.run(0))
        if plan.budget is None:
            allowed = "position, all or a file with a budget: searches need to know what is certified"
            raise ScenarioError(str(self._file), f"{self._where}.budget", None, allowed)
        return plan.budget

    @cached_property
    def tree(self) -> ComponentTree:
        """The team."""
        return planning_problem(self.variation.scenarios[0]).tree

    @cached_property
    def digest(self) -> str:
        """Digest of what the plan is made from."""
        return self._plans.digest_of(self.variation.run(0))

    def allows(self, values: Mapping[str, Any]) -> bool:
        """Whether the scenario allows these values of its keys."""
        with suppress(DataError):
            self.variation.scenario_of(Run(0, 0, 0, dict(values)))
            return True
        return False

    def run_all(self, chosen: Sequence[Mapping[str, Any]], seed: int = 0) -> list[RunRecord]:
        """Make one run for each choice of departures, with a seed for what is still drawn."""
        records = []
        for values in chosen:
            records.append(self._maker.record(Run(0, 0, seed, dict(values))))
            self._made()
        return records

    def write_found(self, values: Mapping[str, Any], file: Path, seed: int = 0) -> Path:
        """Write a campaign file whose run 0 is the run with these departures, for ``campaign replay``."""
        beside, budget = self._file.parent / self._name, self.variation.budget
        name = os.path.relpath(beside, file.parent) if beside.exists() else self._name
        if budget is not None and Path(budget).is_file():
            budget = os.path.relpath(budget, file.parent)
        section: dict[str, Any] = {
            "scenarios": [name],
            "count": 1,
            "set": dict(self._section.set),
            "budget": budget,
            "tier": self._section.tier,
            "grid": {key: [value] for key, value in {**values, "deployment.seed": seed}.items()},
        }
        text = yaml.safe_dump({"runs": section}, sort_keys=False, allow_unicode=True)
        return write_atomically(file, text.encode())


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


def tasks(order: dict[str, Any], alive: Callable[[], None]) -> Iterator[Task]:
    """Yield the searches or bisections of a batch that are to be made."""
    from benchmarks.study import load_study

    folder, batch = CampaignFolder(Path(order["folder"])), order["batch"]
    study = load_study(folder.campaign, Path(order["campaign"]))
    searching = Searching(study, folder, batch["tier"], batch["scenario"], alive)
    check_unchanged(order, searching.batch(batch["first"], batch["stop"]))
    for index in range(order["begin"], batch["stop"]):
        yield searching.begun(index), partial(searching.record, index)


SEARCHES = Work("searches", Finding, f"{__name__}:tasks")
"""Searches for runs with small margins."""

BISECTIONS = Work("breaking", BreakingPoint, f"{__name__}:tasks")
"""Bisections of departures."""
