"""Every key of a scenario file, from the dataclasses that hold it."""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing
from collections.abc import Iterator
from typing import Any, NamedTuple

from coop_drake.scenario.json_schema import field_meanings
from coop_drake.scenario.model import Scenario
from coop_drake.typed_data import FieldType, classes_by_tag, describe, field_types

__all__ = ["ScenarioKey", "Section", "sections"]


class ScenarioKey(NamedTuple):
    """One key.

    Attributes:
        name: As it stands in the file.
        kind: Type and limits of its value, in words.
        unit: Unit of its value, empty if it has none.
        default: Default as YAML text, empty if the key is required.
        meaning: Its meaning, in one or two sentences.
    """

    name: str
    kind: str
    unit: str
    default: str
    meaning: str


class Section(NamedTuple):
    """The keys of one class.

    Attributes:
        path: Key of the section in the file, empty for the file itself.
        about: Purpose of the section.
        keys: Keys in the section.
    """

    path: str
    about: str
    keys: tuple[ScenarioKey, ...]


def sections(cls: Any = Scenario, path: str = "") -> Iterator[Section]:
    """Yield the section of a class, and those inside it, from the top down.

    Args:
        cls: A dataclass that is read from scenario files.
        path: Its key in the file.
    """
    meanings = field_meanings(cls)
    keys = []
    for name, field in field_types(cls).items():
        unit, meaning = _unit_apart(meanings[name])
        keys.append(ScenarioKey(name, describe(field.kind, brief=True), unit, _default(field), meaning))
    yield Section(path, (inspect.getdoc(cls) or "").split("\n\n")[0], tuple(keys))
    for name, field in field_types(cls).items():
        place = f"{path}.{name}" if path else name
        for part in (field.kind, *typing.get_args(field.kind)):
            for tag, inner in classes_by_tag(part).items():
                yield from sections(inner, f"{place}.NAME: {tag}")
        if dataclasses.is_dataclass(field.kind):
            yield from sections(field.kind, place)
        yield from _inner_sections(field.kind, place)


def _inner_sections(kind: Any, place: str) -> Iterator[Section]:
    """Yield the sections of entries of mappings and lists, and of values that may be null."""
    suffix = {dict: ".NAME", tuple: "[]"}.get(typing.get_origin(kind), "")
    for part in typing.get_args(kind):
        if isinstance(part, type) and dataclasses.is_dataclass(part) and not classes_by_tag(kind):
            yield from sections(part, place + suffix)


def _unit_apart(meaning: str) -> tuple[str, str]:
    """Return the unit in brackets, and the sentence without it."""
    found = re.search(r" ?\[([^\]]+)\]", meaning)
    if found is None:
        return "", meaning
    return found.group(1), meaning.replace(found.group(0), "", 1)


def _default(field: FieldType) -> str:
    value = field.default
    if value is dataclasses.MISSING:
        return ""
    if dataclasses.is_dataclass(value):
        return "see below"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return "[]" if value == () else str(value)
