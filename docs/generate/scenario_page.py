"""The pages of scenario files and of campaign files, from the dataclasses that hold every key."""

from __future__ import annotations

import dataclasses
import inspect
import json
import re
import typing
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from coop_drake.campaign.file import Campaign
from coop_drake.scenario.json_schema import field_meanings
from coop_drake.scenario.model import Scenario
from coop_drake.typed_data import FieldType, classes_by_tag, describe, field_types

_TOP = """# Scenario files

A scenario is one YAML file that ends in `.scenario.yaml`. [How to write one](../how_to/own_scenario.md) shows
a small one. `workspace`, `directives`, `start` and `goal` are required; keys that are not here are refused.
In brackets stand the unit, what a key may be (a number, or true or false, if nothing is said), and its
default; a key with the default `null` may be null. Frames are those of the [conventions](../conventions.md).
`make docs` makes this page from the classes that hold the values.
"""

_CAMPAIGN = """# Campaign files

A campaign is one YAML file that ends in `.campaign.yaml`; [how to run one](../how_to/campaign.md). In
brackets stand the unit, what a key may be, and its default; a key with the default `null` may be null.
`make docs` makes this page from the classes that hold the values.
"""


class ScenarioKey(NamedTuple):
    """One key; its type and limits in words, its unit and its default, which may be empty."""

    name: str
    kind: str
    unit: str
    default: str
    meaning: str


class Section(NamedTuple):
    """The keys of one class, at a path in the file that is empty for the file itself."""

    path: str
    about: str
    keys: tuple[ScenarioKey, ...]


def scenario_page() -> str:
    """Return the page of scenario files: one list for each section."""
    return "\n".join([_TOP, *_lists(sections())])


def campaign_page() -> str:
    """Return the page of campaign files, likewise."""
    return "\n".join([_CAMPAIGN, *_lists(sections(Campaign))])


def _lists(found: Iterable[Section]) -> Iterator[str]:
    """Yield the list of every section; sections with the same keys have one, where the first stands.

    A key whose section has a list of its own is not listed above it, too.
    """
    places: dict[tuple[str, tuple[ScenarioKey, ...]], list[str]] = {}
    for section in found:
        places.setdefault((section.about, section.keys), []).append(section.path)
    alone = {same[0] for same in places.values() if len(same) == 1}
    for (about, keys), same in places.items():
        inside = f"{same[0]}." if same[0] else ""
        entries = [_entry(key) for key in keys if f"{inside}{key.name}" not in alone]
        others = f"The same keys stand in {', '.join(f'`{path}`' for path in same[1:])}.\n"
        heading = f"## `{same[0]}`" if same[0] else "## The file"
        if entries:
            yield "\n".join([heading, "", about, "", *([others] if len(same) > 1 else []), *entries, ""])


def _entry(key: ScenarioKey) -> str:
    """Return the line of one key: its name; in brackets unit, type and limits, default; its meaning."""
    kind = _short(key.kind).removesuffix(", or null" if key.default == "null" else "")
    kind = "" if kind == "number" else kind
    facts = [key.unit.removeprefix("-"), kind, f"`{key.default}`" if key.default else "required"]
    if key.default == "see below":
        facts = ["section"]
    return f"- `{key.name}` ({'; '.join(fact for fact in facts if fact)}): {key.meaning}"


_SHORTER = (
    (r"a finite number", "number"),
    (r"a list of 2, each entry number", "2 numbers"),
    (r"a mapping with a tag, one of ", ""),
    (r"a mapping from names to ", "by name: "),
    (r"a list, each entry ", "list of "),
    (r"zero or a positive (whole number|number)", r"\1 ≥ 0"),
    (r"a positive (whole number|number)", r"\1 > 0"),
    (r"a (whole number|number) of at least ", r"\1 ≥ "),
    (r"a (whole number|number) between (\S+) and (\S+)", r"\1 from \2 to \3"),
    (r", less than ", " and < "),
    (r", at most ", " and ≤ "),
    (r"\ba (text|section|whole number|number)", r"\1"),
    (r"whole number", "integer"),
    (r"number ([≥>])", r"\1"),
    (r"\bnumber from ", ""),
    (r"list of number\b", "list of numbers"),
)
"""How types and limits in words are said on the pages, in a few characters."""


def _short(kind: str) -> str:
    """Return the type and limits of a key in a few characters."""
    for words, shorter in _SHORTER:
        kind = re.sub(words, shorter, kind)
    return "" if kind == "true or false" else kind


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
    if value is None or isinstance(value, bool) or value == ():
        return json.dumps(value)
    return str(value)
