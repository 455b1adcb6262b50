"""JSON documents that hold a dataclass: written in one way only, and read with every value checked."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from coop_drake.answers.digest import content_digest
from coop_drake.errors import PlanError, ScenarioError, shortened
from coop_drake.files import check_readable, write_atomically
from coop_drake.typed_data import DataError, convert, convert_class

_LARGEST = 1000.0
"""Largest file of a plan or a proof [MB]; those of the shipped scenarios have a few."""
Content = TypeVar("Content")

DIGITS = 300
"""Digits of the longest integer that is read as it is; a float cannot hold one of more than 308 digits."""


@dataclass(frozen=True)
class Document:
    """The content of a JSON file. Refusals are PlanErrors with the file, key, value and what is allowed.

    Attributes:
        file: The file's path as the user wrote it.
        content: What the file holds.
    """

    file: str
    content: Any

    @classmethod
    def load(cls, path: Path | str, what: str) -> Document:
        """Read a JSON file that should hold ``what``; every key may stand once in a mapping."""
        file, expected = str(path), f"expected the JSON of {what}"
        try:
            text = check_readable(Path(path), _LARGEST).read_text(encoding="utf-8")
            return cls(file, json.loads(text, object_pairs_hook=_mapping, parse_int=_whole_number))
        except json.JSONDecodeError as error:
            raise PlanError(f"{file}: line {error.lineno}: {error.msg}; {expected}") from error
        except DataError as error:
            cls(file, None).refuse(error.key, error.value, error.allowed)
        except (OSError, RecursionError, UnicodeDecodeError) as error:
            raise PlanError(f"{file}: cannot be read: {error}; {expected}") from error

    def refuse(self, key: str, value: object, allowed: str) -> NoReturn:
        """Say what stands at a key, such as ``cells[3].upper``, and what is allowed there."""
        place = key or "document"
        raise PlanError(f"{self.file}: {place}: {shortened(value)} is not allowed; expected {allowed}")

    def check_entry(self, key: str, *allowed: object) -> Any:
        """Return one of the document's own entries; only some values are allowed for it."""
        if not isinstance(self.content, dict):
            self.refuse("", self.content, "a mapping")
        value, expected = self.content.get(key), [repr(entry) for entry in allowed]
        if repr(value) not in expected:  # Unlike the values themselves, the texts of True and 1 differ.
            self.refuse(key, value, " or ".join(expected))
        return value

    def read(self, kind: type[Content], head: Collection[str]) -> Content:
        """Read a dataclass from all entries but those of the head and the digest; no key may be unknown."""
        body = {key: value for key, value in self.content.items() if key not in ("digest", *head)}
        try:
            for key in ("problem", "digest"):
                convert(self.content.get(key), str, key)
            return convert_class(body, kind)
        except DataError as error:
            raise PlanError(str(ScenarioError.of(self.file, error.faults))) from error

    def entry(self, key: str) -> Any:
        """Return what stands at a key, such as ``cells[3].upper``."""
        value = self.content
        for step in re.findall(r"\w+", key):
            value = value[int(step)] if isinstance(value, list) else value[step]
        return value

    def check_length(self, key: str, count: int) -> None:
        """Refuse a list that has another number of entries."""
        values = self.entry(key)
        if len(values) != count:
            self.refuse(key, values, f"{count} entries, not {len(values)}")

    def check_intervals(self, key: str, axes: int, *, points: bool = False) -> None:
        """Refuse ends at ``key`` + lower, upper unless lower < upper on every axis (<= with points)."""
        for end in ("lower", "upper"):
            self.check_length(f"{key}{end}", axes)
        ends = (map(float, self.entry(f"{key}{end}")) for end in ("lower", "upper"))
        for axis, (lower, upper) in enumerate(zip(*ends, strict=True)):
            if lower > upper or (lower == upper and not points):
                least = f"{lower} or more" if points else f"more than {key}lower[{axis}], {lower}"
                self.refuse(f"{key}upper[{axis}]", upper, least)

    def check_digest(self) -> None:
        """Refuse a document whose entry ``digest`` is not that of its other entries."""
        found, expected = self.content["digest"], content_digest(self.content)
        if found != expected:
            self.refuse("digest", found, f"'{expected}': the content is not what was written")


def write_document(path: Path | str, content: Mapping[str, Any], rows: Collection[str]) -> Path:
    """Write a document so that people and tools that compare texts can follow it; whole or not at all.

    Args:
        path: Where to write it; it is returned.
        content: Plain data; the entry ``digest`` is added.
        rows: Keys of the entries that are lists, with one line for every item; they stand last.
    """
    entries = {key: _line(value) for key, value in content.items() if key not in rows}
    entries["digest"] = _line(content_digest(content))
    lists = {key: ",\n  ".join(map(_line, content[key])) for key in rows if key in content}
    entries |= {key: f"[\n  {lines}\n ]" for key, lines in lists.items()}
    text = ",\n".join(f' "{key}": {entry}' for key, entry in entries.items())
    return write_atomically(path, f"{{\n{text}\n}}\n".encode())


def _line(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    mapping = dict(pairs)
    names = [name for name, _ in pairs]
    for name in mapping if len(mapping) < len(pairs) else ():
        if names.count(name) > 1:
            raise DataError(name, mapping[name], "each key at most once; a mapping has this one twice")
    return mapping


def _whole_number(text: str) -> int | float:
    return int(text) if len(text) <= DIGITS else math.inf
