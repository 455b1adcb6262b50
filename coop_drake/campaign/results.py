"""The folder of a campaign's results: one Parquet file for each batch, whole or not there."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coop_drake.campaign.batches import Batch
from coop_drake.campaign.plans import source_digest
from coop_drake.campaign.records import Record, RunRecord, schema_of, table_of
from coop_drake.errors import CoopDrakeError
from coop_drake.files import write_atomically

if TYPE_CHECKING:
    import pyarrow


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
