"""Drake's own types inside scenario files: model directives.

Their parts are built here from their fields, because Drake's YAML loader names no key where a value is wrong.
Poses and other values whose types have many forms are left to that loader.
"""

from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np
from pydrake.common.yaml import yaml_dump, yaml_dump_typed, yaml_load_typed
from pydrake.multibody import parsing

from coop_drake.scenario.document import parse
from coop_drake.typed_data import Codec, DataError, below, convert


def read_directive(value: object, key: str) -> parsing.ModelDirective:
    """Read a model directive from plain data that stands at ``key``.

    Raises:
        DataError: The first departure; a number in it that is not finite or too large is one.
    """
    return _read(value, parsing.ModelDirective, key)


def write_directive(directive: parsing.ModelDirective) -> object:
    """Return a model directive as plain data."""
    return parse(yaml_dump_typed(directive))


def _read(value: object, kind: Any, key: str) -> Any:
    """Read a value of one of Drake's types."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType) and type(None) in arguments:
        return None if value is None else _read(value, arguments[0], key)
    if kind is str:
        return convert(value, str, key)
    if kind == list[str]:
        return list(convert(value, tuple[str, ...], key))
    if kind is np.ndarray:
        return np.array(convert(value, tuple[float, ...], key))
    if origin is dict:
        reader = Codec(lambda item, place: _read(item, arguments[1], place), parse)
        return convert(value, dict[str, Annotated[Any, reader]], key)
    if not hasattr(kind, "__fields__"):
        return _read_by_drake(value, kind, key)
    fields = {field.name: field.type for field in kind.__fields__}
    names = ", ".join(fields)
    if not isinstance(value, dict):
        raise DataError(key, value, f"a mapping with keys among {names}")
    for name in value:
        if name == "_tag":
            raise DataError(key, value[name], "a mapping without a tag")
        if name not in fields:
            raise DataError(below(key, name), value[name], f"one of the keys {names}")
    if kind.__module__ != parsing.__name__:
        return _read_by_drake(value, kind, key)
    return kind(**{name: _read(item, fields[name], below(key, name)) for name, item in value.items()})


def _read_by_drake(value: object, kind: Any, key: str) -> Any:
    """Let Drake's YAML loader read a value whose numbers are finite and not too large."""
    _check_numbers(value, key)
    try:
        return yaml_load_typed(schema=kind, data=yaml_dump(value))
    except (AssertionError, AttributeError, RuntimeError, TypeError, ValueError) as error:
        reason = "a vector of the wrong size" if "incompatible function" in str(error) else str(error)
        name = getattr(kind, "__name__", "value")
        raise DataError(key, value, f"a {name} as Drake reads it ({' '.join(reason.split())})") from error


def _check_numbers(value: object, key: str) -> None:
    """Refuse numbers that are not finite or too large; YAML 1.1 takes some of them, ``1e-3``, for texts."""
    if isinstance(value, list):
        for index, item in enumerate(value):
            _check_numbers(item, f"{key}[{index}]")
    elif isinstance(value, dict):
        for name, item in value.items():
            _check_numbers(item, below(key, name))
    elif _is_number(value):
        convert(value, float, key)


def _is_number(value: object) -> bool:
    """Whether Drake would read a number."""
    try:
        float(value)  # type: ignore[arg-type]
    except OverflowError:
        return True
    except (TypeError, ValueError):
        return False
    return not isinstance(value, bool)
