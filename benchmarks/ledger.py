"""The file of results: a list of rows that every benchmark adds to, whole at every moment."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from benchmarks.rows import Row
from coop_drake.errors import CoopDrakeError
from coop_drake.files import write_atomically

__all__ = ["Ledger", "LedgerError"]

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
