"""Measured figures beside their peers, the file that every benchmark adds to, and what shows them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from coop_drake.errors import CoopDrakeError
from coop_drake.files import write_atomically


@dataclass(frozen=True)
class Row:
    """A figure and what it is compared with.

    Attributes:
        name: What was measured, as ``topic/.../item/figure``.
        value: The figure; for an ``answer`` 1 if it is decided (found or proved), 0 if not.
        unit: Its unit; for an ``answer`` the answer itself.
        peer: What stands beside it, empty if nothing does.
        peer_value: The peer's figure in the same unit, None if it has none.
    """

    name: str
    value: float
    unit: str
    peer: str = ""
    peer_value: float | None = None

    @property
    def topic(self) -> str:
        """What its table is about."""
        return self.name.rsplit("/", 2)[0]

    @property
    def item(self) -> str:
        """The line of its table."""
        return self.name.rsplit("/", 2)[1]

    @property
    def figure(self) -> str:
        """The column of its table."""
        return self.name.rsplit("/", 2)[2]

    @property
    def ratio(self) -> float | None:
        """The figure in units of its peer's."""
        return None if not self.peer_value else self.value / self.peer_value

    def as_dict(self) -> dict[str, str | float | None]:
        """The row as it goes into the JSON file."""
        return {
            "name": self.name,
            "value": self.value,
            "unit": self.unit,
            "peer": self.peer,
            "peer_value": self.peer_value,
            "ratio": self.ratio,
        }


_KEYS = {"name", "value", "unit", "peer", "peer_value", "ratio"}


class LedgerError(CoopDrakeError):
    """A file that should hold results holds something else."""


class Ledger:
    """Rows by name, in the order in which they came; written after every addition.

    Args:
        path: The file.
        fresh: Whether to forget what the file held; otherwise rows of the same name are replaced.

    Raises:
        LedgerError: The file is there but holds no rows.
    """

    def __init__(self, path: Path, *, fresh: bool) -> None:
        self.path = path
        self._rows = {} if fresh or not path.exists() else {row.name: row for row in _read(path)}

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows, old and new."""
        return tuple(self._rows.values())

    def add(self, rows: Iterable[Row]) -> None:
        """Take rows in and write the file."""
        self._rows.update({row.name: row for row in rows})
        entries = [row.as_dict() for row in self.rows]
        write_atomically(self.path, json.dumps(entries, indent=2, allow_nan=False).encode() + b"\n")


def _read(path: Path) -> list[Row]:
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise LedgerError(f"{path}: not a JSON file ({error}); expected a list of rows") from error
    if not isinstance(entries, list):
        raise LedgerError(f"{path}: expected a list of rows")
    for entry in entries:
        if not isinstance(entry, dict) or set(entry) != _KEYS:
            raise LedgerError(f"{path}: {entry!r} is no row; expected the keys {', '.join(sorted(_KEYS))}")
    return [Row(**{key: entry[key] for key in _KEYS - {"ratio"}}) for entry in entries]


def best_seconds(
    work: Callable[[], object], repeats: int, *, clock: Callable[[], float] = perf_counter
) -> float:
    """Return the shortest of several times [s]; the first call warms caches and does not count.

    Args:
        work: What to time.
        repeats: How many times.
        clock: Tells the time [s]: wall time by default.
    """
    work()
    return min(seconds(work, clock) for _ in range(repeats))


def seconds(work: Callable[[], object], clock: Callable[[], float] = perf_counter) -> float:
    """Return what one call takes [s]; arguments as in `best_seconds`."""
    start = clock()
    work()
    return clock() - start
