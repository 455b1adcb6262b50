"""The JSON Schema of scenario files, made from the dataclasses, their docstrings and Drake's own fields."""

import dataclasses
import inspect
import re
import types
import typing
from typing import Any

from coop_drake.scenario.directives import REQUIRED
from coop_drake.scenario.model import Scenario
from coop_drake.scenario.scalars import LARGEST
from coop_drake.scenario.schema import in_file, required_fields

Schema = dict[str, Any]

_NUMBER: Schema = {"type": "number", "minimum": -LARGEST, "maximum": LARGEST}
_SCALARS: dict[type, Schema] = {
    float: _NUMBER,
    int: {**_NUMBER, "type": "integer"},
    bool: {"type": "boolean"},
    str: {"type": "string"},
}
_ATTRIBUTE = re.compile(r"^    (\w+): (.*?)(?=^    \w+: |\Z)", flags=re.MULTILINE | re.DOTALL)


def scenario_schema() -> Schema:
    """The schema, by which an editor completes keys, shows what they mean and marks what is wrong.

    It says less than loading checks: whether rings cross, welds lead somewhere or joints are within their
    limits no schema can tell. Keys that begin with an underscore hold templates and are free.
    """
    schema = _of_class(Scenario)
    schema["patternProperties"] = {"^_": {}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Scenario of coop_drake",
        **schema,
    }


def _of_class(cls: type) -> Schema:
    hints = typing.get_type_hints(cls)
    meanings = field_meanings(cls)
    properties = {f.name: _of_kind(hints[f.name]) for f in in_file(cls)}
    for f in in_file(cls):
        if f.name in meanings:
            properties[f.name]["description"] = meanings[f.name]
        if isinstance(f.default, bool | int | float | str):
            properties[f.name]["default"] = f.default
    required = required_fields(cls)
    return {
        "type": "object",
        "properties": properties,
        "additionalProperties": False,
        **({"required": sorted(required)} if required else {}),
    }


def field_meanings(cls: type) -> dict[str, str]:
    """What the docstring of a class says of every field, with its unit in brackets."""
    text = inspect.getdoc(cls) or ""
    _, _, attributes = text.partition("Attributes:\n")
    found = _ATTRIBUTE.findall(attributes + "\n")
    return {name: " ".join(meaning.split()) for name, meaning in found}


def _of_kind(kind: Any) -> Schema:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind in _SCALARS:
        return dict(_SCALARS[kind])
    if origin is typing.Literal:
        return {"enum": list(arguments)}
    if origin is dict:
        return {"type": "object", "additionalProperties": _of_kind(arguments[1])}
    if origin in (tuple, list):
        size = len(arguments) if len(arguments) > 1 and arguments[1] is not Ellipsis else None
        bounds = {} if size is None else {"minItems": size, "maxItems": size}
        return {"type": "array", "items": _of_kind(arguments[0]), **bounds}
    if origin in (typing.Union, types.UnionType):
        return _of_union(arguments)
    if dataclasses.is_dataclass(kind):
        return _of_class(typing.cast(type, kind))
    return _of_foreign(kind)


def _of_union(arguments: tuple[Any, ...]) -> Schema:
    """Null or a kind; or one of several classes, which a tag tells apart where the file is parsed."""
    kinds = [argument for argument in arguments if argument is not type(None)]
    if not all(isinstance(kind, type) and dataclasses.is_dataclass(kind) for kind in kinds):
        kinds = kinds[:1]  # Of Drake's unions the first is the plain one; it checks the others itself.
    choices = [_of_kind(kind) for kind in kinds]
    for kind, choice in zip(kinds, choices, strict=True):
        if len(kinds) > 1:
            choice["title"] = f"!{kind.__name__}"
            choice["properties"]["_tag"] = {"const": f"!{kind.__name__}"}
    if type(None) in arguments:
        choices.append({"type": "null"})
    return choices[0] if len(choices) == 1 else {"anyOf": choices}


def _of_foreign(kind: Any) -> Schema:
    """A class of Drake's; what is neither text nor list of texts is left to Drake."""
    fields = getattr(kind, "__fields__", None)
    if not fields or kind.__name__ == "Transform":
        return {"type": "object"} if fields else {}
    schema: Schema = {
        "type": "object",
        "properties": {field.name: _of_kind(field.type) for field in fields},
        "additionalProperties": False,
    }
    if kind.__name__ == "ModelDirective":
        for name, required in REQUIRED.items():
            (inner,) = [
                choice for choice in schema["properties"][name]["anyOf"] if choice["type"] == "object"
            ]
            inner["required"] = list(required)
            schema["properties"][name] = inner
        schema.update(minProperties=1, maxProperties=1)
    return schema
