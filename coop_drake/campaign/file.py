"""The campaign file as typed data."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from coop_drake.campaign.distributions import Count, Distribution
from coop_drake.campaign.keys import Plain, Seed, check_keys
from coop_drake.scenario.document import read_file
from coop_drake.typed_data import HIDDEN, DataError, Limits, Positive

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
        batch: Runs of one process and one file; null for 20 of Drake's loop, 2000 of the compiled one.
        time_limit: Longest time for each run of a process; ten minutes more for the first one, which may
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
        """Runs of a batch of a tier: with a process of its own it takes a minute or so."""
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
