"""The JSON Schema of scenario files: pydantic's of the dataclasses, with docstrings and Drake's fields."""

from __future__ import annotations

import inspect
import json
import re
from typing import Any, get_args

from pydantic.json_schema import GenerateJsonSchema
from pydrake.multibody.parsing import ModelDirective

from coop_drake.scenario.directives import REQUIRED
from coop_drake.scenario.model import Scenario
from coop_drake.typed_data import LARGEST, adapter

Schema = dict[str, Any]

_ATTRIBUTE = re.compile(r"^    (\w+): (.*?)(?=^    \w+: |\Z)", flags=re.MULTILINE | re.DOTALL)


def scenario_schema() -> Schema:
    """Return the schema by which an editor completes keys, shows what they mean and marks what is wrong.

    It says less than loading checks: no schema can tell whether rings cross, welds lead somewhere or joints
    are within their limits. Keys that begin with an underscore hold templates and are free.
    """
    schema = adapter(Scenario).json_schema(schema_generator=_Generator)
    scenario = schema["$defs"].pop("Scenario")
    scenario["properties"]["directives"]["items"] = _of_drake(ModelDirective)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Scenario of coop_drake"}
    return {**scenario, **head, "patternProperties": {"^_": {}}, "$defs": schema["$defs"]}


def field_meanings(cls: type) -> dict[str, str]:
    """Return what the docstring of a class says of every field, with its unit in brackets."""
    _, _, attributes = (inspect.getdoc(cls) or "").partition("Attributes:\n")
    return {name: " ".join(meaning.split()) for name, meaning in _ATTRIBUTE.findall(attributes + "\n")}


class _Generator(GenerateJsonSchema):
    """Adds to every field what the docstring says of it, and to plain numbers their largest magnitude."""

    def dataclass_schema(self, schema: Any) -> Schema:
        """Return the schema of a dataclass."""
        result, meanings = super().dataclass_schema(schema), field_meanings(schema["cls"])
        for name, entry in result["properties"].items():
            entry["description"] = meanings[name]
            entry.pop("title", None)
        result.pop("description", None)
        return result

    def int_schema(self, schema: Any) -> Schema:
        """Return the schema of a whole number."""
        return {"minimum": -LARGEST, "maximum": LARGEST} | super().int_schema(schema)


def _of_drake(kind: Any) -> Schema:
    """Schema of a class of Drake; only texts and lists of texts are described; Drake checks the rest."""
    if kind in (str, list[str]):
        return {"type": "string"} if kind is str else {"type": "array", "items": {"type": "string"}}
    if type(None) in get_args(kind):  # Of Drake's other unions the first type is the plain one.
        return {"anyOf": [_of_drake(get_args(kind)[0]), {"type": "null"}]}
    fields = getattr(kind, "__fields__", None)
    if not fields or kind.__name__ == "Transform":
        return {"type": "object"} if fields else {}
    properties = {field.name: _of_drake(field.type) for field in fields}
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
    if kind.__name__ == "ModelDirective":
        for name, required in REQUIRED.items():
            properties[name] = {**properties[name]["anyOf"][0], "required": list(required)}
        schema.update(minProperties=1, maxProperties=1)
    return schema


if __name__ == "__main__":
    print(json.dumps(scenario_schema(), indent=1))
