"""Every key of a scenario file, from the dataclasses that hold it and the checks that refuse it."""

from __future__ import annotations

import dataclasses
import inspect
import re
import types
import typing
from collections.abc import Iterator
from typing import Any, NamedTuple

from coop_drake.errors import ScenarioError
from coop_drake.scenario.json_schema import field_meanings
from coop_drake.scenario.model import Scenario
from coop_drake.scenario.schema import in_file
from coop_drake.scenario.validation import validate

__all__ = ["ScenarioKey", "Section", "sections"]

_WORDS = {bool: "true or false", int: "whole number", float: "number", str: "text"}
_NO_TEXT = "?"
_PROBES = (-1e5, -0.5, 0.0, 0.5, 1.5, 1e5)
_GAIN_SETS = ("FixedGains", "ScheduledGains")


class ScenarioKey(NamedTuple):
    """One key.

    Attributes:
        name: As it stands in the file.
        kind: What kind of value.
        unit: In which unit, empty for what has none.
        default: As YAML has it, empty where the key is required.
        allowed: What the checks ask for beyond the kind.
        meaning: One or two sentences.
    """

    name: str
    kind: str
    unit: str
    default: str
    allowed: str
    meaning: str


class Section(NamedTuple):
    """The keys of one class.

    Attributes:
        path: Where the section stands in the file, empty for the top.
        about: What it is for.
        keys: Its keys.
    """

    path: str
    about: str
    keys: tuple[ScenarioKey, ...]


def sections(scenario: Scenario) -> Iterator[Section]:
    """All sections from the top down.

    Args:
        scenario: One that is valid, whose values are replaced to hear what the checks say.
    """
    yield from _sections(Scenario, "", scenario)


def _sections(cls: type, path: str, scenario: Scenario) -> Iterator[Section]:
    hints, meanings = typing.get_type_hints(cls), field_meanings(cls)
    keys = []
    for field in in_file(cls):
        place = f"{path}.{field.name}" if path else field.name
        unit, meaning = _unit_apart(meanings[field.name])
        allowed = _refusals(scenario, place) or _refused_by_the_class(cls, field.name)
        keys.append(
            ScenarioKey(field.name, _kind(hints[field.name]), unit, _default(field), allowed, meaning)
        )
    yield Section(path, (inspect.getdoc(cls) or "").split("\n\n")[0], tuple(keys))
    for field in in_file(cls):
        place = f"{path}.{field.name}" if path else field.name
        for inner in _classes(hints[field.name]):
            below = f"{place}.NAME: !{inner.__name__}" if inner.__name__ in _GAIN_SETS else place
            yield from _sections(inner, below, scenario)


def _classes(kind: Any) -> list[type]:
    """Dataclasses that a value of a kind is made of."""
    if dataclasses.is_dataclass(kind):
        return [kind] if isinstance(kind, type) else []
    return [cls for part in typing.get_args(kind) for cls in _classes(part)]


def _unit_apart(meaning: str) -> tuple[str, str]:
    """The unit in brackets, and the sentence without it."""
    found = re.search(r" ?\[([^\]]+)\]", meaning)
    if found is None:
        return "", meaning
    return found.group(1), meaning.replace(found.group(0), "", 1)


def _kind(kind: Any) -> str:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind in _WORDS:
        return _WORDS[kind]
    if origin is typing.Literal:
        return " or ".join(f"`{choice}`" for choice in arguments)
    if origin in (typing.Union, types.UnionType):
        names = ["null" if part is type(None) else _kind(part) for part in arguments]
        return " or ".join(names)
    if origin is tuple:
        if len(arguments) == 2 and arguments[1] is not Ellipsis:
            return "(" + ", ".join(map(_kind, arguments)) + ")"
        return f"list of {_kind(arguments[0])}"
    if origin is dict:
        return f"{_kind(arguments[1])} by name"
    return "section" if dataclasses.is_dataclass(kind) else f"Drake's `{kind.__name__}`"


def _default(field: dataclasses.Field[Any]) -> str:
    if field.default is not dataclasses.MISSING:
        value = field.default
    elif field.default_factory is not dataclasses.MISSING:
        value = field.default_factory()
    else:
        return ""
    if dataclasses.is_dataclass(value) or (isinstance(value, dict) and value):
        return "see below"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return {(): "[]"}.get(value, str(value)) if not isinstance(value, dict) else "{}"


def _refusals(scenario: Scenario, place: str) -> str:
    """What the checks ask for, heard by putting numbers where they do not belong."""
    heard = []
    for probe in (*_PROBES, _NO_TEXT):
        try:
            validate(_replaced(scenario, place.split("."), probe))
        except ScenarioError as error:
            allowed = error.allowed.split(", one of ")[0]  # what follows is about this scenario
            if error.key == place and allowed not in heard:
                heard.append(allowed)
        except (TypeError, ValueError, AttributeError):
            continue
    return "; ".join(heard)


def _refused_by_the_class(cls: type, name: str) -> str:
    """The same from a class that checks itself."""
    heard = []
    for probe in (*_PROBES, _NO_TEXT):
        try:
            cls(**{name: probe})
        except ValueError as error:
            asked = re.search(r"(?:must|expected) (.+?)(?:, got .*)?$", str(error))
            if asked is not None and str(error).startswith(name) and asked.group(1) not in heard:
                heard.append(asked.group(1))
        except TypeError:
            continue
    return "; ".join(heard).replace("be ", "", 1)


def _replaced(value: Any, path: list[str], probe: float | str) -> Any:
    """A frozen value with one number or text replaced.

    Raises:
        TypeError: What stands there is of another kind than what should.
    """
    if path:
        return dataclasses.replace(value, **{path[0]: _replaced(getattr(value, path[0]), path[1:], probe)})
    numbers = isinstance(value, int | float) and not isinstance(value, bool)
    if not (value is None or (numbers and not isinstance(probe, str)) or type(value) is type(probe)):
        raise TypeError(f"{value!r} is no place for {probe!r}")
    return int(probe) if isinstance(value, int) and not isinstance(probe, str) else probe
