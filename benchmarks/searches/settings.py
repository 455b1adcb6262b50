"""The sections ``searches`` and ``breaking`` of a campaign file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal

from coop_drake.campaign.distributions import Count
from coop_drake.campaign.keys import LARGEST_SEED, Plain, Seed, check_keys
from coop_drake.typed_data import LARGEST, DataError, Limits, Positive

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
