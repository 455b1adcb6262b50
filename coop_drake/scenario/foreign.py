"""Checks what Drake's own schemas describe: keys and texts here, for Drake names none; the rest by Drake."""

import types
import typing
from typing import Any

from pydrake.common.yaml import yaml_dump, yaml_load_typed

from coop_drake.scenario.scalars import Check, SchemaError, as_number, below, check_scalar


def check_foreign(value: object, kind: type, key: str) -> Check:
    """Yield where a value departs from a class of Drake's; its numbers must be finite and not huge."""
    wrong = list(_check(value, kind, key))
    if wrong:
        yield from wrong
        return
    try:
        yaml_load_typed(schema=kind, data=yaml_dump(value))
    except (AssertionError, AttributeError, RuntimeError, TypeError, ValueError) as error:
        reason = "a vector of the wrong size" if "incompatible function" in str(error) else str(error)
        yield SchemaError(key, value, f"a {kind.__name__} as Drake describes it ({' '.join(reason.split())})")


def _check(value: object, kind: Any, key: str) -> Check:
    """What can be said without Drake's reader; unions of distributions are left to it."""
    arguments = typing.get_args(kind)
    if typing.get_origin(kind) in (typing.Union, types.UnionType) and type(None) in arguments:
        if value is not None:
            yield from _check(value, arguments[0], key)
    elif kind is str:
        yield from check_scalar(value, str, key)
    elif hasattr(kind, "__fields__"):
        yield from _check_fields(value, {f.name: f.type for f in kind.__fields__}, key)
    elif typing.get_origin(kind) is list:
        yield from _check_items(value, arguments[0], key)
    else:
        yield from _check_numbers(value, key)


def _check_fields(value: object, fields: dict[str, Any], key: str) -> Check:
    if not isinstance(value, dict):
        yield SchemaError(key, value, "a mapping with keys among " + ", ".join(fields))
        return
    for name, item in value.items():
        if name in fields:
            yield from _check(item, fields[name], below(key, name))
        elif name == "_tag":
            yield SchemaError(key, item, "a mapping without a tag")
        else:
            yield SchemaError(below(key, name), item, "one of the keys " + ", ".join(fields))


def _check_items(value: object, kind: Any, key: str) -> Check:
    if not isinstance(value, list):
        yield SchemaError(key, value, "a list")
        return
    for index, item in enumerate(value):
        yield from _check(item, kind, f"{key}[{index}]")


def _check_numbers(value: object, key: str) -> Check:
    """Every number inside, also one that YAML takes for a text."""
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _check_numbers(item, below(key, name))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _check_numbers(item, f"{key}[{index}]")
    elif as_number(value) is not None:
        yield from check_scalar(value, float, key)
