"""JSON documents that hold a dataclass: written in one way only, and read with every value checked."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeVar

import msgspec
import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers.digest import as_json, content_digest
from coop_drake.errors import PlanError
from coop_drake.laws.gains import FUNNEL_SHAPES
from coop_drake.tree.pose import FloatArray

__all__ = ["Document", "Head", "NonNegative", "Positive", "document_text"]

NonNegative = Annotated[float, msgspec.Meta(ge=0.0)]
Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Ring = Annotated[list[tuple[float, float]], msgspec.Meta(min_length=3)]
Content = TypeVar("Content")
AnyHead = TypeVar("AnyHead", bound="Head")

SHOWN = 60
"""Characters of a wrong value that a message shows: a whole cell would fill the screen."""

DIGITS = 300
"""Digits of the longest integer that is read as a number; floats end at 308."""

IN_WORDS = {
    "`float": "`a finite number",
    "`int": "`a whole number",
    "`str": "`a string",
    "`bool": "`true or false",
    "`array": "`a list",
    "`object": "`a mapping",
    "`": "",
}
"""What msgspec calls the types of values, and plain words for them."""


class Head(msgspec.Struct):
    """What every document begins with.

    Attributes:
        format: What the document says it is.
        version: Version of its layout.
        problem: Digest of the planning problem that it answers.
        digest: Digest of all its other entries.
    """

    format: str
    version: int
    problem: str
    digest: str


class Rings(msgspec.Struct):
    """A polygon as it is written: rings without their closing vertices [m]."""

    outer: Ring
    holes: list[Ring]


@dataclass(frozen=True)
class Document:
    """The content of a JSON file. Refusals are PlanErrors with the file, key, value and what is allowed.

    Attributes:
        file: The file's path as the user wrote it.
        content: What the file holds. Numbers that no float can hold, such as NaN, are left as strings.
    """

    file: str
    content: Any

    @classmethod
    def load(cls, path: Path | str, what: str) -> Document:
        """Read a JSON file that should hold ``what``; every key may stand once in a mapping."""
        file, expected = str(path), f"expected the JSON of {what}"

        def mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
            names = [name for name, _ in pairs]
            for name in names:
                if names.count(name) > 1:
                    raise PlanError(f"{file}: {name}: stands twice in one mapping; expected every key once")
            return dict(pairs)

        numbers: dict[str, Any] = {"parse_float": _float, "parse_int": _int, "parse_constant": str}
        try:
            text = Path(path).read_text(encoding="utf-8")
            return cls(file, json.loads(text, object_pairs_hook=mapping, **numbers))
        except json.JSONDecodeError as error:
            raise PlanError(f"{file}: line {error.lineno}: {error.msg}; {expected}") from error
        except (OSError, RecursionError, UnicodeDecodeError) as error:
            raise PlanError(f"{file}: cannot be read: {error}; {expected}") from error

    def read_head(self, kind: type[AnyHead], /, **allowed: Collection[Any]) -> AnyHead:
        """Read what the document begins with; for some entries only some values are allowed."""
        head = self._converted(kind)
        for key, values in allowed.items():
            if getattr(head, key) not in values:
                self.refuse(key, " or ".join(map(repr, values)))
        return head

    def read(self, kind: type[Content], head: Head) -> Content:
        """Read a dataclass of numbers, strings, arrays, polygons and dataclasses; no key may be left over."""
        content = self._converted(kind)
        for key, known in _unknown_keys(self.content, content, head.__struct_fields__):
            raise PlanError(f"{self.file}: {key[1:]}: is unknown; expected the keys {', '.join(known)}")
        return content

    def _converted(self, kind: type[Content]) -> Content:
        try:
            return msgspec.convert(self.content, kind, dec_hook=_array_or_polygon)
        except msgspec.ValidationError as error:
            # Paths of nested calls follow each other: "Expected `float` - at `$[2]` - at `$.start`".
            finding, *rest = re.split(r" - at `\$(.*?)`", str(error))
            key = "".join(reversed(rest[::2])).removeprefix(".")
        missing = re.fullmatch(r"Object missing required field `(.*)`", finding)
        if missing:
            name = f"{key}.{missing[1]}".removeprefix(".")
            raise PlanError(f"{self.file}: {name}: is missing; expected a value of this name")
        if finding.startswith("Invalid enum value"):  # There is only one enumeration.
            finding = " or ".join(map(repr, FUNNEL_SHAPES))
        allowed = finding.removeprefix("Expected ").partition(", got")[0]
        for name, words in IN_WORDS.items():
            allowed = allowed.replace(name, words)
        self.refuse(key, allowed)

    def refuse(self, key: str, allowed: str) -> NoReturn:
        """Say what stands at a key, such as ``cells[3].upper``, and what is allowed there."""
        value = self.content
        for name, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", key):
            value = value[int(index)] if index else value[name]
        shown = repr(value)
        shown = shown if len(shown) <= SHOWN else f"{shown[:SHOWN]}..."
        raise PlanError(f"{self.file}: {key or 'document'}: {shown} is not allowed; expected {allowed}")

    def check_length(self, key: str, values: Sequence[Any] | FloatArray, count: int) -> None:
        """Refuse a list that has another number of entries."""
        if len(values) != count:
            self.refuse(key, f"{count} entries, not {len(values)}")

    def check_intervals(
        self, key: str, lower: FloatArray, upper: FloatArray, axes: int, *, points: bool = False
    ) -> None:
        """Refuse ends at ``key`` + lower, upper unless lower < upper on every axis (<= with points)."""
        self.check_length(f"{key}lower", lower, axes)
        self.check_length(f"{key}upper", upper, axes)
        for axis in np.flatnonzero(lower > upper if points else lower >= upper):
            least = f"{lower[axis]} or more" if points else f"more than {key}lower[{axis}], {lower[axis]}"
            self.refuse(f"{key}upper[{axis}]", least)

    def check_digest(self) -> None:
        """Refuse a document whose entry ``digest`` is not that of its other entries."""
        expected = content_digest(self.content)
        if self.content["digest"] != expected:
            self.refuse("digest", f"'{expected}': the content is not what was written")


def document_text(head: Mapping[str, Any], rows: Mapping[str, Sequence[Any]]) -> str:
    """Write a document so that people and tools that compare texts can follow it.

    Args:
        head: Entries of one line each.
        rows: Entries that are lists, with one line for every item.

    Returns:
        The text, with the entry ``digest`` at the end of the head.
    """
    digest = content_digest({**head, **rows})
    lines = [f' "{key}": {_line(value)}' for key, value in {**head, "digest": digest}.items()]
    for key, items in rows.items():
        lines.append(f' "{key}": [\n  ' + ",\n  ".join(map(_line, items)) + "\n ]")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _line(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False, default=as_json)


def _float(text: str) -> float | str:
    value = float(text)
    return value if isfinite(value) else text


def _int(text: str) -> int | str:
    return int(text) if len(text) <= DIGITS else text


def _array_or_polygon(kind: Any, value: Any) -> FloatArray | Polygon:
    """Read what msgspec does not know; it adds the path to the message of a ValueError."""
    try:
        if kind is not Polygon:
            return np.array(msgspec.convert(value, list[float]), dtype=np.float64)
        rings = msgspec.convert(value, Rings)
    except msgspec.ValidationError as error:
        raise ValueError(str(error)) from error
    polygon = Polygon(rings.outer, rings.holes)
    if not polygon.is_valid or polygon.area <= 0.0:
        reason = shapely.is_valid_reason(polygon)
        raise ValueError(f"rings that cross neither themselves nor each other, but found: {reason}")
    return polygon


def _unknown_keys(
    value: Any, read: Any, head: Sequence[str] = (), key: str = ""
) -> Iterator[tuple[str, Sequence[str]]]:
    """Keys of a document that nothing was read from, each with those that are known in its place."""
    if isinstance(value, dict):
        own = [field.name for field in fields(read)] if is_dataclass(read) else ["outer", "holes"]
        known = [*head, *own]
        for name, entry in value.items():
            if name not in known:
                yield f"{key}.{name}", known
            yield from _unknown_keys(entry, getattr(read, name, None), key=f"{key}.{name}")
    elif isinstance(value, list) and isinstance(read, tuple):
        for k, (entry, part) in enumerate(zip(value, read, strict=True)):
            yield from _unknown_keys(entry, part, key=f"{key}[{k}]")
