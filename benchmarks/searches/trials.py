"""Runs of one scenario along its plan, with departures that a search chooses."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.searches.bounds import BoundedDepartures
from benchmarks.searches.settings import Breaking, Searches
from coop_drake.answers.budget import Budget
from coop_drake.campaign.plans import Plans
from coop_drake.campaign.records import RunRecord
from coop_drake.campaign.results import CampaignFolder
from coop_drake.campaign.running.making import RunMaker
from coop_drake.campaign.settings import Campaign, Runs
from coop_drake.campaign.variation import Run, Variation
from coop_drake.errors import ScenarioError
from coop_drake.files import write_atomically
from coop_drake.plant import planning_problem
from coop_drake.tree import ComponentTree
from coop_drake.typed_data import DataError


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
        from benchmarks.searches.settings import Searches

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
