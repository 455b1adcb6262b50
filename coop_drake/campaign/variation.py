"""Which run stands at an index of a campaign: a pure function of the campaign file and the index."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.campaign.file import SEED_KEY, Campaign, Distribution, Gaussian, Runs, Tier
from coop_drake.errors import ScenarioError
from coop_drake.scenario.budget_file import names_file
from coop_drake.scenario.checks import validate
from coop_drake.scenario.document import parse
from coop_drake.scenario.load import load_scenario, with_floor
from coop_drake.scenario.model import Scenario
from coop_drake.shipped import scenario_file
from coop_drake.typed_data import DataError, convert, field_types

_SEEDS = 1_000_000
"""Number of seeds that a deployment may have; no two of so many runs have the same."""

_DRAWS = 1000
"""How often a number that the key does not allow is drawn again: a Gaussian with its mean at a limit needs
two draws in the mean."""

_IN_THE_RUN = ("deployment", "control", "plant", "simulator", "visualization")
"""Sections that a plan does not depend on; ``deployment.budget`` apart."""

_STEP = re.compile(r"\.?([^.\[\]]+)|\[(\d+)\]")


@dataclass(frozen=True)
class Run:
    """One run of a campaign.

    Attributes:
        index: Its index in the campaign.
        scenario: Index of its scenario in the file's list.
        seed: Seed of its noise and losses.
        values: The varied keys and their values.
    """

    index: int
    scenario: int
    seed: int
    values: dict[str, Any]

    @property
    def text(self) -> str:
        """The values as JSON with sorted keys."""
        return json.dumps(self.values, sort_keys=True)


class Variation:
    """The runs of a campaign file, and the scenarios that they simulate.

    Runs are numbered scenario by scenario, in each combination of the grid by combination.

    Args:
        campaign: A campaign with a section ``runs``.
        section: The section of the file that asks for the runs, for messages.

    Raises:
        ScenarioError: A scenario cannot be read, or a key or a value is not allowed in it.
    """

    def __init__(self, campaign: Campaign, section: str = "runs") -> None:
        self.campaign, self._section = campaign, section
        self.runs: Runs = campaign.runs
        self.files = [self._file(name) for name in self.runs.scenarios]

    @cached_property
    def _read(self) -> tuple[Scenario, ...]:
        """The scenarios as they are in their files, in the order of the campaign file."""
        return tuple(load_scenario(file) for file in self.files)

    @cached_property
    def _data(self) -> tuple[dict[str, Any], ...]:
        """The plain data of their files."""
        return tuple(parse(one.path.read_text(encoding="utf-8")) for one in self._read)  # type: ignore[misc]

    @cached_property
    def scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios with what ``set`` says, for which plans are made.

        Raises:
            ScenarioError: A scenario cannot be read, or a key or a value of ``set`` is not allowed in it.
        """
        return tuple(self._checked(k, {}) for k in range(len(self.files)))

    @cached_property
    def budget(self) -> str | None:
        """The choice of the budget; a file stands beside the campaign file, or where the command works.

        Raises:
            ScenarioError: There is no such file.
        """
        choice = self.runs.budget
        if choice is None or not names_file(choice):
            return choice
        beside = self.campaign.path.parent / choice
        found = beside if beside.is_file() else Path(choice)
        if not found.is_file():
            allowed = f"all, position, or a file with a budget (looked for {beside} and {found.absolute()})"
            raise ScenarioError(str(self.campaign.path), f"{self._section}.budget", choice, allowed)
        return str(found)

    def _file(self, name: str) -> Any:
        beside = self.campaign.path.parent / name
        return beside if beside.exists() else scenario_file(name)

    @property
    def runs_of_scenario(self) -> int:
        """How many runs every scenario has."""
        return self.runs.count * prod(len(values) for values in self.runs.grid.values())

    @property
    def count(self) -> int:
        """How many runs there are, each of them in one tier or in both."""
        return self.runs_of_scenario * len(self.runs.scenarios)

    def indices(self, scenario: int, tier: Tier) -> range:
        """Return the indices of the runs of a scenario that are made in a tier."""
        first, number = scenario * self.runs_of_scenario, self.runs_of_scenario
        if tier == "compiled":
            number = 0 if self.runs.tier == "drake" else number
        elif self.runs.tier == "compiled":
            number = min(self.runs.paired, number)
        return range(first, first + number)

    def run(self, index: int) -> Run:
        """Return the run of an index; what is drawn for a key does not depend on the other keys.

        Raises:
            ScenarioError: There is no such run, or no allowed number was drawn for a key.
        """
        if not 0 <= index < self.count:
            allowed = f"the index of a run, 0 to {self.count - 1}"
            raise ScenarioError(str(self.campaign.path), "run", index, allowed)
        scenario, inside = divmod(index, self.runs_of_scenario)
        values = self._point(inside // self.runs.count)
        for key, distribution in self.runs.vary.items():
            values[key] = self._draw(key, distribution, index, scenario)
        seed = (self._first_seed + index) % _SEEDS
        return Run(index, scenario, int(values.get(SEED_KEY, seed)), values)

    def _point(self, number: int) -> dict[str, Any]:
        """Return a combination of the grid by its number; the last key changes fastest."""
        point = {}
        for key, values in reversed(self.runs.grid.items()):
            number, place = divmod(number, len(values))
            point[key] = values[place]
        return {key: point[key] for key in self.runs.grid}

    @cached_property
    def _first_seed(self) -> int:
        return int(np.random.default_rng(self.runs.seed).integers(_SEEDS))

    def _generator(self, index: int, key: str) -> np.random.Generator:
        words = np.random.SeedSequence(self.runs.seed, spawn_key=(index, *key.encode()))
        return np.random.default_rng(words)

    def _draw(self, key: str, distribution: Distribution, index: int, scenario: int) -> float:
        generator = self._generator(index, key)
        if not isinstance(distribution, Gaussian):  # What others draw was checked before.
            return distribution.draw(generator)
        for _ in range(_DRAWS):
            value = distribution.draw(generator)
            try:
                self._changed(scenario, {key: value})
            except DataError as error:
                refused = error
            else:
                return value
        file, allowed = str(self.campaign.path), f"a distribution of what {key} allows: {refused.allowed}"
        raise ScenarioError(file, f"runs.vary.{key}", refused.value, allowed)

    def scenario_of(self, run: Run) -> Scenario:
        """Return the scenario that a run simulates."""
        return self._changed(run.scenario, {**run.values, SEED_KEY: run.seed})

    def planned_values(self, run: Run) -> dict[str, Any]:
        """Return those of a run's values that its plan depends on; often none."""
        return {
            key: value
            for key, value in run.values.items()
            if key.partition(".")[0] not in _IN_THE_RUN or key == "deployment.budget"
        }

    def scenario_to_plan(self, run: Run) -> Scenario:
        """Return the scenario that a run's plan is made for: without what is varied in the run alone."""
        return self._changed(run.scenario, self.planned_values(run))

    def check(self) -> None:
        """Check every value of the grid and the ends of every distribution against every scenario.

        One key at a time takes all its values; the others have the first of theirs.

        Raises:
            ScenarioError: With file, key, value and what is allowed there.
        """
        usual = {key: values[0] for key, values in self._choices.items()}
        for scenario in range(len(self.scenarios)):
            for key, values in self._choices.items():
                for value in values:
                    self._checked(scenario, {**usual, key: value})

    @cached_property
    def _choices(self) -> dict[str, tuple[Any, ...]]:
        """Every value of the grid and the ends of every distribution, by their keys."""
        return {**self.runs.grid, **{key: one.extremes() for key, one in self.runs.vary.items()}}

    def trials(self, scenario: int, *, numbers: bool) -> Iterator[Run]:
        """Yield runs along the plan of a scenario's first run that show whether a loop knows what varies.

        They are that run, and others of which each has another value at one of the keys.

        Args:
            scenario: Index of the scenario.
            numbers: Whether numbers are tried as other values, too.
        """
        first = self.run(scenario * self.runs_of_scenario)
        yield first
        planned = self.planned_values(first)
        for key, values in self._choices.items():
            for value in () if key in planned else values:
                if numbers or not isinstance(value, int | float):
                    yield dataclasses.replace(first, values={**first.values, key: value})

    def _checked(self, scenario: int, values: dict[str, Any]) -> Scenario:
        """Return a scenario with other values when it was checked; errors name the campaign file."""
        try:
            changed = self._changed(scenario, values)
            validate(changed)
        except (DataError, ScenarioError) as error:
            raise self.refusal(scenario, error) from error
        return changed

    def refusal(self, scenario: int, error: DataError | ScenarioError) -> ScenarioError:
        """Return what a scenario does not allow as an error that names the campaign file and its key."""
        sections = [name for name in ("set", "vary", "grid") if error.key in getattr(self.runs, name)]
        place = ".".join([self._section, *sections[-1:], error.key])
        allowed = f"{error.allowed} (in {self.files[scenario].name})"
        return ScenarioError(str(self.campaign.path), place, error.value, allowed)

    def _changed(self, scenario: int, values: dict[str, Any]) -> Scenario:
        """Return a scenario as if its file had what ``set`` says, and other values at dotted keys.

        Raises:
            DataError: There is no such key, or the value is not allowed there.
        """
        read, data, types = self._read[scenario], self._data[scenario], field_types(Scenario)
        sections: dict[str, Any] = {}
        for key, value in {**self.runs.set, **values}.items():
            top, *steps = _steps(key, value, tuple(types))
            sections[top] = _placed(sections.get(top, data.get(top)), steps, value, key)
        changed = {name: convert(section, types[name].kind, name) for name, section in sections.items()}
        made = dataclasses.replace(read, **changed)
        return with_floor(made) if "workspace" in changed else made


def _steps(key: str, value: object, tops: tuple[str, ...]) -> list[Any]:
    """Return the names and indices of a dotted key.

    Raises:
        DataError: It is none, or begins with no section of the scenario.
    """
    steps = [name or int(index) for name, index in _STEP.findall(key)]
    again = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in steps)
    if again.removeprefix(".") != key or not steps or steps[0] not in tops:
        allowed = f"a dotted key of the scenario that begins with one of {', '.join(tops)}"
        raise DataError(key, value, allowed)
    return steps


def _placed(data: Any, steps: list[Any], value: Any, key: str) -> Any:
    """Return plain data with a value placed at the end of some steps; missing mappings are made."""
    if not steps:
        return value
    step, rest = steps[0], steps[1:]
    if isinstance(step, int):
        if not isinstance(data, list) or step >= len(data):
            raise DataError(key, value, f"a key of the scenario; its file has no list with an entry {step}")
        return [_placed(item, rest, value, key) if i == step else item for i, item in enumerate(data)]
    if data is not None and not isinstance(data, dict):
        raise DataError(key, value, f"a key of the scenario; there is no mapping around {step}")
    return {**(data or {}), step: _placed((data or {}).get(step), rest, value, key)}
