"""Drake's own types inside scenario files: model directives.

Drake's YAML loader reads them. It names no key where a value is wrong, so keys, texts and numbers are checked
here before.
"""

from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydrake.common.yaml import yaml_dump, yaml_dump_typed, yaml_load_typed
from pydrake.multibody.parsing import ModelDirective

from coop_drake.scenario.document import parse
from coop_drake.typed_data import Codec, DataError, below, convert


def read_directive(value: object, key: str) -> ModelDirective:
    """Read a model directive from plain data that stands at ``key``.

    Raises:
        DataError: Drake could not read it, or a number in it is not finite or too large.
    """
    _check(value, ModelDirective, key)
    try:
        return yaml_load_typed(schema=ModelDirective, data=yaml_dump(value))
    except (AssertionError, AttributeError, RuntimeError, TypeError, ValueError) as error:
        reason = "a vector of the wrong size" if "incompatible function" in str(error) else str(error)
        allowed = f"a ModelDirective as Drake describes it ({' '.join(reason.split())})"
        raise DataError(key, value, allowed) from error


def write_directive(directive: ModelDirective) -> object:
    """Return a model directive as plain data."""
    return parse(yaml_dump_typed(directive))


Directive = Annotated[ModelDirective, Codec(read_directive, write_directive)]


def _check(value: object, kind: Any, key: str) -> None:
    """Check the keys, texts and numbers of a value; what else is wrong, Drake finds."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType) and type(None) in arguments:
        if value is not None:
            _check(value, arguments[0], key)
    elif kind is str:
        convert(value, str, key)
    elif hasattr(kind, "__fields__"):
        _check_fields(value, {field.name: field.type for field in kind.__fields__}, key)
    elif origin is list and not isinstance(value, list):
        raise DataError(key, value, "a list")
    elif isinstance(value, list):
        for index, item in enumerate(value):
            _check(item, arguments[0] if origin is list else None, f"{key}[{index}]")
    elif isinstance(value, dict):
        for name, item in value.items():
            _check(item, None, below(key, name))
    elif _is_number(value):
        convert(value, float, key)


def _check_fields(value: object, fields: dict[str, Any], key: str) -> None:
    names = ", ".join(fields)
    if not isinstance(value, dict):
        raise DataError(key, value, f"a mapping with keys among {names}")
    for name, item in value.items():
        if name == "_tag":
            raise DataError(key, item, "a mapping without a tag")
        if name not in fields:
            raise DataError(below(key, name), item, f"one of the keys {names}")
        _check(item, fields[name], below(key, name))


def _is_number(value: object) -> bool:
    """Whether Drake would read a number; YAML 1.1 takes ``1e-3`` for a text."""
    try:
        float(value)  # type: ignore[arg-type]
    except OverflowError:
        return True
    except (TypeError, ValueError):
        return False
    return not isinstance(value, bool)
