"""The results of a campaign: records of runs, and one Parquet file for each batch, whole or not there."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import astuple, dataclass, fields
from functools import cache
from math import nan
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

import numpy as np

from coop_drake.answers.document import content_digest
from coop_drake.campaign.file import Campaign, Tier
from coop_drake.campaign.plans import Plans, scenario_content, source_digest
from coop_drake.campaign.variation import Variation
from coop_drake.errors import CoopDrakeError
from coop_drake.files import write_atomically

if TYPE_CHECKING:
    import pyarrow

# What a run of a campaign leaves: one row of a Parquet file.


@dataclass(frozen=True)
class RunRecord:
    """One run. Margins are positive where nothing was lost, and NaN where a tier does not compute them.

    Attributes:
        run: Index in the campaign; the tiers' runs of one index have the same values and the same seed.
        scenario: Name of the scenario.
        tier: ``drake`` for the loop of Drake's systems, ``compiled`` for the compiled loop.
        seed: Seed of noise and losses, ``deployment.seed``.
        values: The varied keys and their values, as JSON with sorted keys.
        arrived: Whether the object came to rest at the goal and no invariant was violated.
        reason: Why it did not arrive; empty if it did.
        time: Duration of the transport in simulated time [s].
        steps: Accepted steps of the integrator, or samples of the compiled loop.
        funnel_margin: Smallest distance of an axis to a bound of its funnel [rad or m].
        funnel_axis: Which axis came as near: ``angle`` or a joint's name.
        funnel_cell: In which cell it did.
        cell_margin: Smallest distance of the object's position to the boundary of its cell's region [m].
        wall_clearance: Smallest distance of any body to any wall [m].
        body_clearance: Smallest distance between bodies that must not touch [m].
        budget_share: Largest share used of what the plan's budget states: of the departures of position,
            velocity, axes and their rates from the nominal ones, or the least distance of an axis to its
            funnel's bounds that it states over the one that was kept. NaN for a plan without a budget, and
            where the run does not allow to tell [-].
        peak_force: Largest force of a base [N].
        peak_torque: Largest effort of a joint [N m or N]; NaN for a team without joints.
        held: How often the team was held at rest.
        digest: SHA-256 of what was run: scenario with its values, plan, and versions.
    """

    run: int
    scenario: str
    tier: str
    seed: int
    values: str
    arrived: bool
    reason: str = ""
    time: float = nan
    steps: int = 0
    funnel_margin: float = nan
    funnel_axis: str = ""
    funnel_cell: int = -1
    cell_margin: float = nan
    wall_clearance: float = nan
    body_clearance: float = nan
    budget_share: float = nan
    peak_force: float = nan
    peak_torque: float = nan
    held: int = 0
    digest: str = ""


Record = Any
"""A row of a file of results: a frozen dataclass of numbers and texts, such as `RunRecord`."""


def schema_of(kind: type[Record]) -> pyarrow.Schema:
    """Return the Parquet schema of a kind of record: a column for each field, in their order."""
    import pyarrow

    types = {int: pyarrow.int64(), float: pyarrow.float64(), bool: pyarrow.bool_(), str: pyarrow.string()}
    hints = get_type_hints(kind)
    return pyarrow.schema([(f.name, types[hints[f.name]]) for f in fields(kind)])


def table_of(records: Iterable[Record], kind: type[Record]) -> pyarrow.Table:
    """Return records of one kind as a table."""
    import pyarrow

    schema = schema_of(kind)
    rows = [astuple(record) for record in records]
    columns: list[list[Any]] = [list(column) for column in zip(*rows, strict=True)] or [[] for _ in schema]
    return pyarrow.table(dict(zip(schema.names, columns, strict=True)), schema=schema)


# The batches of a campaign: consecutive pieces of work, such as runs, of one process and of one file.

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


RUNS = Work("runs", RunRecord, "coop_drake.campaign.runs:tasks")
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


# The folder of a campaign's results: one Parquet file for each batch, whole or not there.


@dataclass(frozen=True)
class CampaignFolder:
    """Where the results of a campaign are.

    Attributes:
        path: The folder; it is made when the first result is there.
    """

    path: Path

    @property
    def campaign(self) -> Path:
        """The campaign file as it was when the command began."""
        return self.path / "campaign.yaml"

    @property
    def plans(self) -> Path:
        """The plans that runs follow, named by digests."""
        return self.path / "plans"

    @property
    def lock(self) -> Path:
        """The file that a command which works in the folder holds a lock of."""
        return self.path / ".lock"

    def write(self, batch: Batch, records: Iterable[Record]) -> None:
        """Write the records of a batch, whole or not at all.

        Raises:
            OSError: The file cannot be written.
        """
        write_table(self.path / batch.file, table_of(records, batch.record))

    def has(self, batch: Batch) -> bool:
        """Whether the records of a batch are there; a damaged file counts as missing."""
        import pyarrow.parquet

        try:
            metadata = pyarrow.parquet.read_metadata(self.path / batch.file)
        except (OSError, pyarrow.ArrowInvalid):
            return False
        return bool(metadata.num_rows == batch.stop - batch.first)

    def missing(self, batches: Iterable[Batch]) -> list[Batch]:
        """Return the batches whose records are not there."""
        return [batch for batch in batches if not self.has(batch)]

    def table(self, batches: Sequence[Batch]) -> pyarrow.Table:
        """Return the records of those batches of runs that are there, sorted by run and tier."""
        return self.records(batches, RunRecord).sort_by([("run", "ascending"), ("tier", "ascending")])

    def records(self, batches: Sequence[Batch], kind: type[Record]) -> pyarrow.Table:
        """Return the records of one kind that are there, batch by batch."""
        import pyarrow

        mine = [one for one in batches if one.record is kind]
        there = [self._read(one) for one in mine if self.has(one)]
        return pyarrow.concat_tables(there) if there else schema_of(kind).empty_table()

    def _read(self, batch: Batch) -> pyarrow.Table:
        import pyarrow.parquet

        file = self.path / batch.file
        try:
            return pyarrow.parquet.read_table(file, columns=schema_of(batch.record).names)
        except (OSError, pyarrow.ArrowInvalid) as error:
            again = "remove it, and the same command makes its runs again"
            raise CoopDrakeError(f"{file} is damaged ({' '.join(str(error).split())}); {again}") from error

    def costs(self, batches: Iterable[Batch]) -> list[dict[str, Any]]:
        """Return what the batches took whose costs are known, as `note` was told."""
        known = []
        for batch in batches:
            with suppress(OSError, ValueError):  # Results do not depend on these files.
                known.append(json.loads((self.path / batch.costs).read_bytes()))
        return known

    def cpu_seconds(self, batches: Iterable[Batch]) -> float:
        """Return the mean processor time of a run or piece of work with its share of starting, or NaN."""
        costs = self.costs(batches)
        counted = sum(entry["runs"] for entry in costs)
        return sum(entry["cpu_seconds"] for entry in costs) / counted if counted else nan

    def by_other_sources(self, batches: Iterable[Batch]) -> int:
        """Return how many batches were made while the sources of this package were other ones than now."""
        return sum(entry.get("sources") != source_digest() for entry in self.costs(batches))

    def note(self, batch: Batch, costs: dict[str, Any]) -> None:
        """Write what a batch took."""
        write_atomically(self.path / batch.costs, json.dumps(costs, sort_keys=True).encode() + b"\n")


def write_table(path: Path, table: pyarrow.Table) -> None:
    """Write a table as a Parquet file, whole or not at all; the same rows give the same bytes."""
    import pyarrow.parquet

    write_atomically(path, lambda stream: pyarrow.parquet.write_table(table, stream))


def state_of(campaign: Campaign, folder: CampaignFolder, batches: Sequence[Batch]) -> list[dict[str, Any]]:
    """Return the state of every scenario and tier that a campaign has runs of.

    Each has ``scenario`` and ``tier``; how many ``runs`` there shall be, how many are ``done``, and how many
    of these were ``lost``; the least ``funnel_margin`` [rad or m] and ``clearance`` to walls and between
    bodies [m]; the largest ``budget_share`` [-]; the ``cpu_seconds`` of a run with its share of starting
    processes. What is not known is NaN.
    """
    rows = []
    for key in dict.fromkeys((batch.scenario, batch.tier) for batch in batches):
        mine = [batch for batch in batches if (batch.scenario, batch.tier) == key]
        table = folder.table(mine)
        column = {name: table.column(name).to_numpy() for name in _COLUMNS}
        rows.append(
            {
                "scenario": Variation(campaign).scenarios[key[0]].name,
                "tier": key[1],
                "runs": sum(batch.stop - batch.first for batch in mine),
                "done": table.num_rows,
                "lost": int((~column["arrived"]).sum()),
                "funnel_margin": _least(column["funnel_margin"]),
                "clearance": _least(np.concatenate([column[name] for name in _CLEARANCES])),
                "budget_share": -_least(-column["budget_share"]),
                "cpu_seconds": folder.cpu_seconds(mine),
            }
        )
    return rows


_CLEARANCES = ("wall_clearance", "body_clearance")
_COLUMNS = ("funnel_margin", "arrived", "budget_share", *_CLEARANCES)


def _least(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.min()) if known.size else nan
