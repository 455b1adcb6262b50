"""One place of a JSON document, with the way that leads to it: asks for what must stand there, or says so."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import partial
from math import inf, isfinite
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers.digest import content_digest
from coop_drake.errors import PlanError
from coop_drake.tree.pose import FloatArray

__all__ = ["Entry"]

SHOWN = 60
"""A wrong value is shown up to this many characters."""


@dataclass(frozen=True)
class Entry:
    """A value somewhere in a document.

    Attributes:
        file: The document's path as the user wrote it.
        key: Where in the document, for example ``cells[3].upper``; empty for the whole.
        value: What stands there.
    """

    file: str
    key: str
    value: Any

    @classmethod
    def load(cls, path: Path | str, what: str) -> Entry:
        """The whole of a JSON file.

        Args:
            path: The file.
            what: What it should be, with its article, for the message.

        Raises:
            PlanError: If it cannot be read, is no JSON, or names a key of a mapping twice.
        """
        file = str(path)
        try:
            text = Path(path).read_text(encoding="utf-8")
            return cls(file, "", json.loads(text, object_pairs_hook=partial(_without_repetitions, file)))
        except json.JSONDecodeError as error:
            raise PlanError(
                f"{file}: line {error.lineno}: {error.msg}; expected the JSON of {what}"
            ) from error
        except (
            OSError,
            RecursionError,
            ValueError,
        ) as error:  # ValueError: no UTF-8, or a number without end
            raise PlanError(f"{file}: cannot be read: {error}; expected the JSON of {what}") from error

    def check_digest(self) -> None:
        """Refuse a document whose entry ``digest`` is not that of its other entries.

        Raises:
            PlanError: Names the digest it has and the one expected.
        """
        expected = content_digest(self.value)
        if self.value["digest"] != expected:
            raise PlanError(
                f"{self.file}: digest: {self.value['digest']!r} is not allowed; expected '{expected}': "
                "the content is not what was written"
            )

    def refuse(self, allowed: str) -> NoReturn:
        """Raise the error that says what is wrong here.

        Raises:
            PlanError: Always.
        """
        shown = repr(self.value)
        shown = shown if len(shown) <= SHOWN else f"{shown[:SHOWN]}..."
        raise PlanError(f"{self.file}: {self.key or 'document'}: {shown} is not allowed; expected {allowed}")

    def fields(self, *names: str) -> dict[str, Entry]:
        """The entries of a mapping that must have these keys and no others."""
        if not isinstance(self.value, dict):
            self.refuse("a mapping with the keys " + ", ".join(names))
        prefix = f"{self.key}." if self.key else ""
        for name in names:
            if name not in self.value:
                raise PlanError(
                    f"{self.file}: {prefix}{name}: is missing; expected the keys {', '.join(names)}"
                )
        for name in self.value:
            if name not in names:
                raise PlanError(
                    f"{self.file}: {prefix}{name}: is unknown; expected the keys {', '.join(names)}"
                )
        return {name: Entry(self.file, prefix + name, self.value[name]) for name in names}

    def items(self, at_least: int = 0, exactly: int | None = None) -> list[Entry]:
        """The entries of a list of at least, or of exactly, so many."""
        count = exactly if exactly is not None else at_least
        if not isinstance(self.value, list) or len(self.value) < count:
            self.refuse(f"a list of {count} or more entries")
        if exactly is not None and len(self.value) != exactly:
            raise PlanError(f"{self.file}: {self.key}: has {len(self.value)} entries; expected {exactly}")
        return [Entry(self.file, f"{self.key}[{k}]", value) for k, value in enumerate(self.value)]

    def one_of(self, *allowed: Any) -> Any:
        """A value that must be one of a few."""
        if not any(type(self.value) is type(value) and self.value == value for value in allowed):
            self.refuse(" or ".join(repr(value) for value in allowed))
        return self.value

    def text(self) -> str:
        """A string."""
        if not isinstance(self.value, str):
            self.refuse("a string")
        return self.value

    def flag(self) -> bool:
        """True or false."""
        return bool(self.one_of(True, False))

    def number(self, *, positive: bool = False, at_least: float | None = None) -> float:
        """A finite number."""
        allowed = "a finite number"
        allowed += ", positive" if positive else f", at least {at_least}" if at_least is not None else ""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            self.refuse(allowed)
        try:
            number = float(self.value)
        except OverflowError:
            number = inf
        if not isfinite(number) or (positive and number <= 0.0):
            self.refuse(allowed)
        if at_least is not None and number < at_least:
            self.refuse(allowed)
        return number

    def numbers(self, count: int, *, positive: bool = False) -> FloatArray:
        """A list of exactly so many finite numbers, as an array."""
        return np.array([entry.number(positive=positive) for entry in self.items(exactly=count)], dtype=float)

    def polygon(self) -> Polygon:
        """A polygon with holes whose rings neither cross themselves nor each other."""
        fields = self.fields("outer", "holes")
        rings = [_ring(ring) for ring in (fields["outer"], *fields["holes"].items())]
        polygon = Polygon(rings[0], rings[1:])
        if not polygon.is_valid or polygon.area <= 0.0:
            reason = shapely.is_valid_reason(polygon)
            raise PlanError(
                f"{self.file}: {self.key}: {reason}; expected rings that cross neither "
                "themselves nor each other"
            )
        return polygon


def _without_repetitions(file: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise PlanError(f"{file}: {twice}: stands twice in one mapping; expected every key once")
    return result


def _ring(entry: Entry) -> list[tuple[float, float]]:
    points = [point.numbers(2) for point in entry.items(at_least=3)]
    return [(float(x), float(y)) for x, y in points]
