"""The campaign file as typed data."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from coop_drake.scenario.document import read_file
from coop_drake.typed_data import EXACT, HIDDEN, TAGGED, DataError, Limits, NotNegative, Positive, Real

# From what the values of a varied key are drawn: the distributions of Drake's schema, by the same names.

_BETWEEN = 0.3819660112501051
"""Where in an interval a number is tried for a key [-]: at no simple fraction of it."""


@dataclass(frozen=True)
class Deterministic:
    """Always the same number.

    Attributes:
        value: The number, in the unit of the key.
    """

    value: Real

    def draw(self, generator: np.random.Generator) -> float:
        """Return the number."""
        return self.value

    def extremes(self) -> tuple[float, ...]:
        """Return the number."""
        return (self.value,)


@dataclass(frozen=True)
class Uniform:
    """Any number between two, each as likely.

    Attributes:
        min: Smallest number, in the unit of the key.
        max: Largest number; it is itself never drawn unless it is the smallest, too.
    """

    min: Real
    max: Real

    def __post_init__(self) -> None:
        if self.max < self.min:
            raise DataError("max", self.max, f"a number of at least min, {self.min:g}")

    def draw(self, generator: np.random.Generator) -> float:
        """Draw a number."""
        return float(generator.uniform(self.min, self.max))

    def extremes(self) -> tuple[float, ...]:
        """Return the ends of the interval, and a number between that is not whole."""
        return self.min, self.max, self.min + _BETWEEN * (self.max - self.min)


@dataclass(frozen=True)
class Gaussian:
    """A normal distribution. What the key does not allow is drawn again, so that its limits cut it off.

    Attributes:
        mean: Mean, in the unit of the key.
        stddev: Standard deviation.
    """

    mean: Real
    stddev: NotNegative

    def draw(self, generator: np.random.Generator) -> float:
        """Draw a number."""
        return float(generator.normal(self.mean, self.stddev))

    def extremes(self) -> tuple[float, ...]:
        """Return the mean: there are no ends."""
        return (self.mean,)


@dataclass(frozen=True)
class UniformDiscrete:
    """One of some numbers, each as likely.

    Attributes:
        values: The numbers, in the unit of the key.
    """

    values: tuple[Real, ...]

    def __post_init__(self) -> None:
        if not self.values:
            raise DataError("values", [], "a list of at least one number")

    def draw(self, generator: np.random.Generator) -> float:
        """Draw one of the numbers."""
        return self.values[int(generator.integers(len(self.values)))]

    def extremes(self) -> tuple[float, ...]:
        """Return all numbers."""
        return self.values


Distribution = Annotated[Deterministic | Uniform | Gaussian | UniformDiscrete, TAGGED]
"""What a varied key is drawn from, by its tag."""

Count = Annotated[int, Limits(at_least=1)]
"""A number of things of which there is at least one."""


# Types of values that stand in several sections of a campaign file.

Plain = Any
"""A value as it would stand in a scenario file; the scenario's own key says what is allowed."""

LARGEST_SEED = 2**32 - 1
"""Largest seed: numpy and optimisers take no larger one everywhere, and tables of records hold it."""

Seed = Annotated[int, Limits(at_least=0, below=LARGEST_SEED + 1), EXACT]
"""From what numbers are drawn."""

SEED_KEY = "deployment.seed"
"""The key of the seed of noise and losses, which every run has of its own."""


def check_keys(said: Mapping[str, Any], **varied: Mapping[str, Any]) -> None:
    """Refuse a seed that would be ignored, and values that would overwrite others inside them.

    What ``set`` says of a whole section may be varied in parts.

    Args:
        said: What ``set`` says, by dotted keys.
        varied: What differs from run to run, by dotted keys, each by the name of its section.

    Raises:
        DataError: With the key and what is allowed there.
    """
    top, _, name = SEED_KEY.partition(".")
    whole = said.get(top)
    if SEED_KEY in said or (isinstance(whole, dict) and name in whole):
        allowed = "no seed: every run has one of its own, which grid may state"
        raise DataError(f"set.{SEED_KEY}", said.get(SEED_KEY, whole), allowed)
    sections = {"set": said, **varied}
    places = [(section, key) for section, keys in sections.items() for key in keys]
    for section, outer in places:
        for other, inner in places:
            inside = inner.startswith((f"{outer}.", f"{outer}["))
            if inside and (section != "set" or other == "set"):
                allowed = f"no key around {other}.{inner}: each would overwrite the other"
                raise DataError(f"{section}.{outer}", sections[section][outer], allowed)


Tier = Literal["drake", "compiled"]
"""Which loop a run is made by."""


@dataclass(frozen=True)
class Runs:
    """Runs of transports whose scenarios vary.

    Attributes:
        scenarios: Scenario files, relative to the campaign file, or names of shipped scenarios.
        count: Runs of every scenario and every combination of the grid.
        set: Values in every run and in the plan, by their dotted keys.
        vary: Distributions from which every run draws values, by dotted keys.
        grid: Values of which every combination is run, by dotted keys.
        seed: Seed of all that is drawn.
        tier: Which loop makes the runs; ``both`` makes each run twice.
        paired: With ``compiled``, how many of the first runs of every scenario Drake's loop makes, too.
        budget: Under which budget the plans must hold, as ``plan --budget`` takes it; null for what the
            scenarios require.
        batch: Runs of one task and one file; null for 20 of Drake's loop, 2000 of the compiled one.
        time_limit: Longest time for each run; ten minutes more for the first one of a batch, which may
            compile kernels [s].
        keep: Of which of Drake's runs the log is kept.
    """

    scenarios: tuple[str, ...]
    count: Count
    set: dict[str, Plain] = field(default_factory=dict)
    vary: dict[str, Distribution] = field(default_factory=dict)
    grid: dict[str, tuple[Plain, ...]] = field(default_factory=dict)
    seed: Seed = 0
    tier: Literal["drake", "compiled", "both"] = "drake"
    paired: Annotated[int, Limits(at_least=0)] = 20
    budget: str | None = None
    batch: Count | None = None
    time_limit: Positive = 120.0
    keep: Literal["none", "lost", "all"] = "none"

    def batch_of(self, tier: Tier) -> int:
        """Runs of a batch of a tier: it takes a minute or so."""
        return self.batch or {"drake": 20, "compiled": 2000}[tier]

    def __post_init__(self) -> None:
        if not self.scenarios:
            raise DataError("scenarios", [], "at least one scenario")
        for key, values in self.grid.items():
            if not values:
                raise DataError(f"grid.{key}", [], "at least one value")
            if key in self.vary:
                raise DataError(f"grid.{key}", list(values), "a key that vary does not have, too")
        check_keys(self.set, vary=self.vary, grid=self.grid)


_STUDIES = ("questions", "searches", "breaking")
"""Sections of files that the benchmarks read."""


@dataclass(frozen=True)
class Campaign:
    """What a campaign does.

    Attributes:
        runs: Runs of transports.
        path: The file it was read from.
    """

    runs: Runs
    path: Annotated[Path, HIDDEN] = Path("campaign.yaml")

    @staticmethod
    def completed(content: dict[str, Any]) -> dict[str, Any]:
        """Refuse sections of studies by the command that knows them.

        Raises:
            DataError: There is one.
        """
        for name in _STUDIES:
            if name in content:
                known = "`python -m benchmarks study FILE`, in a clone of the repository"
                raise DataError(name, content[name], f"runs alone; others are for {known}")
        return content

    @property
    def name(self) -> str:
        """The file's name without ``.campaign.yaml``."""
        return self.path.name.removesuffix(".yaml").removesuffix(".yml").removesuffix(".campaign")


def load_campaign(path: Path | str, original: Path | None = None) -> Campaign:
    """Read a campaign file; what its scenarios allow is checked by :mod:`coop_drake.campaign.variation`.

    Args:
        path: The file.
        original: Where the file that this is a copy of is: names of scenarios are relative to it.

    Raises:
        ScenarioError: With file, key, value and what is allowed there.
    """
    file = Path(path)
    return dataclasses.replace(read_file(Campaign, file), path=original or file)
