"""The JSON Schema of scenario files, made from the dataclasses, their docstrings and Drake's own fields."""

import dataclasses
import inspect
import json
import math
import re
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydrake.multibody.parsing import ModelDirective

from coop_drake.scenario.directive import DirectiveEntry
from coop_drake.scenario.directives import REQUIRED
from coop_drake.scenario.model import Scenario
from coop_drake.typed_data import LARGEST, Limits, classes_by_tag, field_types

Schema = dict[str, Any]

_NUMBER: Schema = {"type": "number", "minimum": -LARGEST, "maximum": LARGEST}
_SCALARS: dict[type, Schema] = {
    float: _NUMBER,
    int: {**_NUMBER, "type": "integer"},
    bool: {"type": "boolean"},
    str: {"type": "string"},
}
_LIMITS = {
    "exclusiveMinimum": "above",
    "minimum": "at_least",
    "exclusiveMaximum": "below",
    "maximum": "at_most",
}
_ATTRIBUTE = re.compile(r"^    (\w+): (.*?)(?=^    \w+: |\Z)", flags=re.MULTILINE | re.DOTALL)


def scenario_schema() -> Schema:
    """Return the schema by which an editor completes keys, shows what they mean and marks what is wrong.

    It says less than loading checks: no schema can tell whether rings cross, welds lead somewhere or joints
    are within their limits. Keys that begin with an underscore hold templates and are free.
    """
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Scenario of coop_drake"}
    return {**head, **_of_class(Scenario), "patternProperties": {"^_": {}}}


def field_meanings(cls: type) -> dict[str, str]:
    """Return what the docstring of a class says of every field, with its unit in brackets."""
    _, _, attributes = (inspect.getdoc(cls) or "").partition("Attributes:\n")
    return {name: " ".join(meaning.split()) for name, meaning in _ATTRIBUTE.findall(attributes + "\n")}


def _of_class(cls: Any) -> Schema:
    fields, meanings = field_types(cls), field_meanings(cls)
    properties = {name: _of_kind(field.kind) for name, field in fields.items()}
    for name, field in fields.items():
        properties[name]["description"] = meanings[name]
        if isinstance(field.default, bool | int | float | str):
            properties[name]["default"] = field.default
    required = sorted(name for name, field in fields.items() if field.default is dataclasses.MISSING)
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    return {**schema, "required": required} if required else schema


def _of_kind(kind: Any) -> Schema:
    origin, arguments = get_origin(kind), get_args(kind)
    if kind in _SCALARS:
        return dict(_SCALARS[kind])
    if origin is Annotated:
        ends = {
            name: getattr(limits, end)
            for limits in arguments[1:]
            if isinstance(limits, Limits)
            for name, end in _LIMITS.items()
            if math.isfinite(getattr(limits, end))
        }
        return _of_kind(arguments[0]) | ends
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin is dict:
        return {"type": "object", "additionalProperties": _of_kind(arguments[1])}
    if origin in (tuple, list):
        fixed = origin is tuple and Ellipsis not in arguments
        ends = {"minItems": len(arguments), "maxItems": len(arguments)} if fixed else {}
        return {"type": "array", "items": _of_kind(arguments[0]), **ends}
    if origin in (Union, UnionType):
        return _of_union(kind)
    if kind is DirectiveEntry:
        return _of_drake(ModelDirective)
    return _of_drake(kind) if not dataclasses.is_dataclass(kind) else _of_class(kind)


def _of_union(kind: Any) -> Schema:
    """Schema of a choice: several classes, which a tag distinguishes in the file, or one type or null."""
    choices = []
    for tag, cls in classes_by_tag(kind).items():
        choice = _of_class(cls)
        choice["properties"]["_tag"] = {"const": tag}
        choices.append({"title": tag, **choice})
    if not choices:  # Of Drake's unions the first type is the plain one; Drake checks the others.
        choices.append(_of_kind(get_args(kind)[0]))
    if type(None) in get_args(kind):
        choices.append({"type": "null"})
    return choices[0] if len(choices) == 1 else {"anyOf": choices}


def _of_drake(kind: Any) -> Schema:
    """Schema of a class of Drake; only texts and lists of texts are described; Drake checks the rest."""
    fields = getattr(kind, "__fields__", None)
    if not fields or kind.__name__ == "Transform":
        return {"type": "object"} if fields else {}
    properties = {field.name: _of_kind(field.type) for field in fields}
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    if kind.__name__ == "ModelDirective":
        for name, required in REQUIRED.items():
            properties[name] = {**properties[name]["anyOf"][0], "required": list(required)}
        schema.update(minProperties=1, maxProperties=1)
    return schema


if __name__ == "__main__":
    print(json.dumps(scenario_schema(), indent=1))
