"""Scenarios that depart from their schema: keys missing, unknown, misspelt; values of the wrong type."""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Iterator
from typing import Any

from coop_drake.scenario import Scenario
from coop_drake.scenario.model import DirectiveEntry
from tests.support.mutants.mutant import Mutant, Place, at, block, dotted, put, renamed, without

_NUMBERS = {
    "a text": "wide",
    "a truth": True,
    "a list": [1.0],
    "a mapping": {"metres": 1.0},
    "no number": math.nan,
    "an infinity": math.inf,
    "a negative infinity": -math.inf,
    "a huge number": 1e300,
    "a huge negative number": -1e300,
    "nothing": None,
}
_WRONG: dict[Any, dict[str, Any]] = {
    float: _NUMBERS,
    int: {**_NUMBERS, "a fraction": 1.5},
    str: {"a number": 3, "a list": ["text"], "a mapping": {"text": 1}, "a truth": False, "nothing": None},
    bool: {"a text": "maybe", "a number": 3, "a list": [True], "nothing": None},
    typing.Literal: {"another word": "nonsense", "a number": 3, "a list": ["nonsense"], "nothing": None},
    tuple: {"a text": "wide", "a number": 3.0, "a mapping": {"first": 1}, "nothing": None},
    dict: {"a text": "wide", "a number": 3.0, "a list": [1], "nothing": None},
}
_SECTION = {"a text": "wide", "a number": 3.0, "a list": [], "nothing": None}


def schema_mutants(data: dict[str, Any]) -> Iterator[Mutant]:
    """Departures at every place of a scenario that a dataclass describes."""
    for path, kind in _places(data, Scenario, ()):
        if dataclasses.is_dataclass(kind):
            yield from _of_section(data, path, typing.cast(type, kind))
        else:
            yield from _of_value(data, path, kind)


def _mutant(kind: str, path: Place, because: str, data: Any, key: str | None = None) -> Mutant:
    return Mutant(kind, dotted(path), because, block(data).encode(), dotted(path) if key is None else key)


def _of_section(data: dict[str, Any], path: Place, cls: type) -> Iterator[Mutant]:
    section = at(data, path)
    fields = {f.name: f for f in dataclasses.fields(cls)}
    for name in section:
        if name == "_tag":
            continue
        here, field = (*path, name), fields[name]
        required = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        if required:
            yield _mutant("missing key", here, "the key has no default", without(data, here))
        misspelt = f"{name}_"
        assert misspelt not in fields
        yield _mutant(
            "misspelt key",
            here,
            "no key has this name",
            renamed(data, here, misspelt),
            dotted((*path, misspelt)),
        )
    unknown = (*path, "colour")
    yield _mutant("unknown key", unknown, "no key has this name", put(data, unknown, "red"))
    for what, value in _SECTION.items() if path else ():
        yield _mutant(f"{what} for a section", path, "a section is a mapping", put(data, path, value))


def _of_value(data: dict[str, Any], path: Place, kind: Any) -> Iterator[Mutant]:
    arguments = typing.get_args(kind)
    optional = type(None) in arguments
    if optional:
        kind = arguments[0]
    origin = typing.get_origin(kind) or kind
    for what, value in _WRONG[origin].items():
        if not (optional and value is None):
            because = (
                f"the schema wants {origin.__name__ if isinstance(origin, type) else 'one of a few words'}"
            )
            yield _mutant(f"{what} for {_called(origin)}", path, because, put(data, path, value))


def _called(origin: Any) -> str:
    return {float: "a number", int: "a whole number", str: "a text", bool: "a truth", tuple: "a list"}.get(
        origin, "a mapping" if origin is dict else "a word"
    )


def _places(value: Any, kind: Any, path: Place) -> Iterator[tuple[Place, Any]]:
    """Every place of a document with the type that stands there; Drake's own types are left out."""
    arguments, origin = typing.get_args(kind), typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType) and isinstance(value, dict):
        tag = value["_tag"].removeprefix("!")
        kind = next(a for a in arguments if a.__name__ == tag)
    if dataclasses.is_dataclass(kind) and kind is not DirectiveEntry:
        yield path, kind
        hints = typing.get_type_hints(kind)
        for name in value:
            if name != "_tag":
                yield from _places(value[name], hints[name], (*path, name))
    elif kind in _WRONG or origin in _WRONG or type(None) in arguments:
        yield path, kind
        if origin is tuple:
            for index, item in enumerate(value):
                yield from _places(item, arguments[0], (*path, index))
        elif origin is dict:
            for name, item in value.items():
                yield from _places(item, arguments[1], (*path, name))
