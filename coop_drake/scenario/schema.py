"""Reads frozen dataclasses with Drake's YAML loader, and says at which key a file departs from its schema.

Drake's ``yaml_load_typed`` fills objects by assignment, starting from their defaults. For every frozen class
a *draft* is made: a class of the same name whose fields can be assigned and all have defaults. Drake fills
the draft, and the frozen value is made from it.
"""

import dataclasses
import types
import typing
from functools import cache
from typing import Any

from pydrake.common.yaml import yaml_load_typed

from coop_drake.scenario.document import parse
from coop_drake.scenario.foreign import check_foreign
from coop_drake.scenario.scalars import SCALARS, Check, SchemaError, below, check_scalar


def in_file(cls: type) -> tuple[dataclasses.Field[Any], ...]:
    """Fields of a dataclass that stand in the file."""
    return tuple(f for f in dataclasses.fields(cls) if f.metadata.get("in_file", True))


def read(cls: type, text: str) -> Any:
    """Read a frozen dataclass from YAML text that has passed :func:`departures`.

    Raises:
        SchemaError: A class refused its values.
    """
    return freeze(yaml_load_typed(schema=draft(cls), data=text), cls)


def departures(cls: type, text: str) -> Check:
    """Yield every place where a YAML text departs from the schema ``cls``."""
    yield from _check(parse(text), cls, "")


def required_fields(cls: type) -> frozenset[str]:
    """Names of the fields that a file must have."""
    return frozenset(
        f.name
        for f in in_file(cls)
        if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
    )


def _is_union(kind: Any) -> bool:
    return typing.get_origin(kind) in (typing.Union, types.UnionType)


@cache
def draft(cls: type) -> type:
    """Make the class that Drake fills: the same fields, assignable, each with a default."""
    hints: dict[str, Any] = typing.get_type_hints(cls)
    fields: list[tuple[str, Any, Any]] = []
    for f in in_file(cls):
        default: Any = dataclasses.field(default=None)
        if f.default is not dataclasses.MISSING:
            default = dataclasses.field(default=f.default)
        elif f.default_factory is not dataclasses.MISSING:
            default = dataclasses.field(default_factory=_thawing(f.default_factory))
        elif dataclasses.is_dataclass(hints[f.name]):
            default = dataclasses.field(default_factory=draft(hints[f.name]))
        elif typing.get_origin(hints[f.name]) is dict:
            default = dataclasses.field(default_factory=dict)
        fields.append((f.name, _draft_kind(hints[f.name]), default))
    return dataclasses.make_dataclass(cls.__name__, fields)


def _thawing(factory: Any) -> Any:
    return lambda: thaw(factory())


def _draft_kind(kind: Any) -> Any:
    """The type that Drake sees: tuples are lists, literals are texts, frozen classes are drafts."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        return draft(typing.cast(type, kind))
    if origin is typing.Literal:
        return str
    if origin is tuple:
        return list[_draft_kind(arguments[0])]  # type: ignore[misc]
    if origin is dict:
        return dict[str, _draft_kind(arguments[1])]  # type: ignore[misc]
    if _is_union(kind):
        drafts = [_draft_kind(a) for a in arguments]
        if all(dataclasses.is_dataclass(a) for a in arguments):
            drafts.insert(
                0, str
            )  # Drake leaves the tag of the first kind away; here every class wants its tag
        return typing.Union[tuple(drafts)]  # noqa: UP007
    return kind


def _drafted(kind: type) -> type:
    return draft(kind) if dataclasses.is_dataclass(kind) else kind


def thaw(value: Any) -> Any:
    """Turn frozen values into drafts, all the way down; the inverse of :func:`freeze`."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        kind = type(value)
        return draft(kind)(**{f.name: thaw(getattr(value, f.name)) for f in in_file(kind)})
    if isinstance(value, dict):
        return {key: thaw(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [thaw(item) for item in value]
    return value


def freeze(value: Any, kind: Any, key: str = "") -> Any:
    """Turn a draft into the frozen value of type ``kind``, all the way down.

    Raises:
        SchemaError: A class refused its values.
    """
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        return _freeze_fields(value, typing.cast(type, kind), key)
    if origin is tuple:
        return tuple(freeze(item, arguments[0], f"{key}[{index}]") for index, item in enumerate(value))
    if origin is dict:
        return {name: freeze(item, arguments[1], below(key, name)) for name, item in value.items()}
    if _is_union(kind):
        frozen = [a for a in arguments if isinstance(a, type) and _drafted(a) is type(value)]
        return freeze(value, frozen[0], key) if frozen and _drafted(frozen[0]) is not frozen[0] else value
    return value


def _freeze_fields(value: Any, cls: type, key: str) -> Any:
    hints = typing.get_type_hints(cls)
    fields = {f.name: freeze(getattr(value, f.name), hints[f.name], below(key, f.name)) for f in in_file(cls)}
    try:
        return cls(**fields)
    except ValueError as error:  # by custom the message begins with the field's name
        name = str(error).partition(" ")[0]
        raise SchemaError(
            below(key, name) if name in fields else key, fields.get(name), str(error)
        ) from error


def _check(value: object, kind: Any, key: str) -> Check:
    """Dispatch on the kind of schema."""
    origin = typing.get_origin(kind)
    if kind in SCALARS:
        yield from check_scalar(value, kind, key)
    elif origin is typing.Literal:
        if value not in typing.get_args(kind):
            yield SchemaError(key, value, "one of " + ", ".join(typing.get_args(kind)))
    elif origin in (tuple, list):
        yield from _check_sequence(value, kind, key)
    elif origin is dict:
        yield from _check_mapping(value, typing.get_args(kind)[1], key)
    elif _is_union(kind):
        yield from _check_union(value, kind, key)
    elif dataclasses.is_dataclass(kind):
        cls = typing.cast(type, kind)
        hints = typing.get_type_hints(cls)
        schema = {f.name: hints[f.name] for f in in_file(cls)}
        yield from _check_fields(value, schema, required_fields(cls), key)
    else:
        yield from check_foreign(value, kind, key)


def _check_sequence(value: object, kind: Any, key: str) -> Check:
    arguments = typing.get_args(kind)
    size = len(arguments) if len(arguments) > 1 and arguments[1] is not Ellipsis else None
    if not isinstance(value, list):
        yield SchemaError(key, value, "a list")
    elif size is not None and len(value) != size:
        yield SchemaError(key, value, f"a list of {size}")
    else:
        for index, item in enumerate(value):
            yield from _check(item, arguments[0], f"{key}[{index}]")


def _check_mapping(value: object, kind: Any, key: str) -> Check:
    if not isinstance(value, dict):
        yield SchemaError(key, value, "a mapping")
        return
    for name, item in value.items():
        if not isinstance(name, str):
            yield SchemaError(below(key, name), name, "a text as the name")
        else:
            yield from _check(item, kind, below(key, name))


def _check_union(value: object, kind: Any, key: str) -> Check:
    arguments = typing.get_args(kind)
    if value is None and type(None) in arguments:
        return
    classes = {a.__name__: a for a in arguments if isinstance(a, type) and dataclasses.is_dataclass(a)}
    if not classes:
        yield from _check(value, arguments[0], key)
        return
    content = dict(value) if isinstance(value, dict) else {}
    tag = str(content.pop("_tag", ""))
    if tag.removeprefix("!") not in classes:
        yield SchemaError(
            key, tag or value, "a mapping with a tag, one of " + ", ".join(f"!{n}" for n in classes)
        )
    else:
        yield from _check(content, classes[tag.removeprefix("!")], key)


def _check_fields(value: object, schema: dict[str, Any], required: frozenset[str], key: str) -> Check:
    if not isinstance(value, dict):
        yield SchemaError(key or "the file", value, "a mapping with the keys " + ", ".join(schema))
        return
    for name in value:
        if name not in schema:
            yield SchemaError(below(key, name), value[name], "one of the keys " + ", ".join(schema))
    for name, kind in schema.items():
        if name in value:
            yield from _check(value[name], kind, below(key, name))
        elif name in required:
            yield SchemaError(below(key, name), None, "a value; this key is required")
