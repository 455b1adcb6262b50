"""The plans that runs follow, each made once and kept in the campaign's folder."""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import coop_drake
from coop_drake.answers import Found, Plan, load_plan, save_plan
from coop_drake.answers.document import content_digest
from coop_drake.campaign.variation import Run, Variation
from coop_drake.errors import PlanError
from coop_drake.files import cache_folder
from coop_drake.harmonic_maps import HarmonicMap, MapStore
from coop_drake.plant import planning_problem
from coop_drake.plant.facts import budget_of, models_digest
from coop_drake.progress import Progress
from coop_drake.scenario.budget_file import names_file
from coop_drake.scenario.model import Scenario
from coop_drake.simulation import build_maps
from coop_drake.typed_data import to_plain

Maps = tuple[HarmonicMap, ...]
"""The harmonic map of every cell of a plan."""

_KEPT = 4
"""Plans with their maps that a process keeps in memory; runs of one batch mostly have one."""


@cache
def versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    names = (
        "coop-drake",
        "drake",
        "numpy",
        "scipy",
        "shapely",
        "networkx",
        "manifold3d",
        "numba",
        "llvmlite",
    )
    return {name: version(name) for name in names}


@cache
def source_digest() -> str:
    """Return the SHA-256 of this package's modules, by their names and contents when this is called first.

    Someone who changes the package tells his results apart by it; the version stays the same meanwhile.
    """
    root = Path(coop_drake.__file__).parent
    return content_digest(
        {path.relative_to(root).as_posix(): _file_digest(path) for path in root.rglob("*.py")}
    )


def scenario_content(scenario: Scenario) -> dict[str, Any]:
    """Return all that a scenario says, and the digest of what Drake reads from its models, as plain data."""
    said = to_plain(scenario, Scenario)
    return {"scenario": said, "models": models_digest(scenario), "versions": versions()}


def _file_digest(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()


class Plans:
    """The plans of a campaign.

    Args:
        variation: Its runs.
        folder: Where plans are kept.
    """

    def __init__(self, variation: Variation, folder: Path) -> None:
        self.variation, self._folder = variation, folder
        self._ready: dict[str, tuple[Plan, Maps]] = {}

    def digest_of(self, run: Run) -> str:
        """Return the digest of what a run's plan is made from; of a budget's file by its content.

        Raises:
            ScenarioError: There is no file of the budget.
        """
        scenario, budget = self.variation.scenario_to_plan(run), self.variation.budget
        said: Any = budget
        if budget is not None and names_file(budget):
            said = {"file": _file_digest(Path(budget))}
        return content_digest({**scenario_content(scenario), "budget": said})

    def plan_of(self, run: Run, progress: Progress | None = None) -> Plan:
        """Return the plan that a run follows, from the folder if these sources have made it there.

        Raises:
            PlanError: There is none; the message says why.
        """
        key = content_digest({"asked": self.digest_of(run), "sources": source_digest()})
        path = self._folder / f"{key}.json"
        if path.exists():
            return load_plan(path)
        found = _planned(self.variation.scenario_to_plan(run), self.variation.budget, progress)
        save_plan(found, path)
        return load_plan(path)  # Runs follow what the file says, to the last bit.

    def with_maps(self, run: Run, progress: Progress | None = None) -> tuple[Plan, Maps]:
        """Return the plan that a run follows, and its maps.

        Raises:
            PlanError: There is no plan; the message says why.
            FieldError: A cell cannot be mapped.
        """
        digest = self.digest_of(run) if self.variation.planned_values(run) else f"of {run.scenario}"
        if digest not in self._ready:
            plan = self.plan_of(run, progress)
            tolerance = self.variation.scenario_to_plan(run).maps.tolerance
            store = MapStore(cache_folder("maps"))
            maps = build_maps(plan, tolerance=tolerance, store=store, workers=1, progress=progress)
            while len(self._ready) >= _KEPT:
                del self._ready[next(iter(self._ready))]
            self._ready[digest] = plan, maps
        return self._ready[digest]


def _planned(scenario: Scenario, budget: str | None, progress: Progress | None) -> Plan:
    from coop_drake.planning.planner import plan

    name, problem = scenario.selected_gains, planning_problem(scenario)
    tolerated = budget_of(budget, scenario, problem)
    gains = scenario.gain_sets[name]
    result = plan(problem, gains, gain_set_name=name, budget=tolerated, progress=progress)
    if isinstance(result, Found):
        return result.plan
    raise PlanError(f"no plan for {scenario.path.name}: {result.reason}")
