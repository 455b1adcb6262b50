"""Which version of a compiled function belongs to the arguments of a call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

ARRAY_FLAGS = 0x1 | 0x2 | 0x100 | 0x400
"""Bits of numpy's flags that machine code depends on: C order, Fortran order, aligned, writable."""

_SCALARS = {float: "float", np.float64: "float", int: "int", np.int64: "int", bool: "bool", np.bool_: "bool"}

_SEEN_MOST = 32
"""Number of tuples whose kind is remembered; a command has a handful of teams and floors."""

_seen: dict[int, tuple[object, object]] = {}
"""Tuples by their identity, each with its kind; arrays in them keep their types."""


def kind_of(value: Any) -> object:
    """Return what numba's type of a value depends on, as something that can be compared and hashed."""
    cls = value.__class__
    if cls is np.ndarray:
        return value.dtype, value.ndim, value.flags.num & ARRAY_FLAGS
    if (scalar := _SCALARS.get(cls)) is not None:
        return scalar
    if isinstance(value, tuple):
        seen = _seen.get(id(value))
        if seen is not None and seen[0] is value:
            return seen[1]
        kind = (cls, *map(kind_of, value))
        if len(_seen) >= _SEEN_MOST:
            _seen.clear()
        _seen[id(value)] = value, kind
        return kind
    return cls


def dispatcher(
    count: int, versions: Mapping[tuple[object, ...], Callable[..., Any]], other: Callable[..., Any]
) -> Callable[..., Any]:
    """Return a function that calls the version for its arguments, or ``other`` where there is none yet.

    It is made for these versions as a text of comparisons, because a simulation makes some hundred thousand
    calls: so a call costs about a microsecond, a look-up by the kinds of its arguments three.

    Args:
        count: Number of arguments.
        versions: The versions by the kinds of their arguments, see `kind_of`.
        other: Gets all arguments where no version is for them, or where an array's dtype is equal to that of
            a version but another object.
    """
    names = ", ".join(f"a{i}" for i in range(count))
    scope: dict[str, Any] = {"Array": np.ndarray, "other": other, "matches": _matches}
    lines = [f"def call({names}):"]
    for number, (kinds, version) in enumerate(versions.items()):
        tests = [_test(kind, f"a{i}", scope) for i, kind in enumerate(kinds)]
        scope[f"version{number}"] = version
        lines += [f"    if {' and '.join(tests) or True}:", f"        return version{number}({names})"]
    lines.append(f"    return other({names})")
    exec("\n".join(lines), scope)
    call: Callable[..., Any] = scope["call"]
    return call


def _test(kind: object, name: str, scope: dict[str, Any]) -> str:
    """Return the text of the test whether an argument is of a kind; what it needs is put into its scope."""
    if isinstance(kind, str):
        classes = [cls for cls, scalar in _SCALARS.items() if scalar == kind]
        return f"({' or '.join(f'{name}.__class__ is {_put(cls, scope)}' for cls in classes)})"
    if isinstance(kind, tuple) and isinstance(kind[0], np.dtype):
        dtype, dimensions, flags = kind
        return (
            f"{name}.__class__ is Array and {name}.dtype is {_put(dtype, scope)} "
            f"and {name}.ndim == {dimensions} and {name}.flags.num & {ARRAY_FLAGS} == {flags}"
        )
    if isinstance(kind, tuple) and all(isinstance(part, str) for part in kind[1:]):
        parts = [_test(part, f"{name}[{i}]", scope) for i, part in enumerate(kind[1:])]
        same = f"{name}.__class__ is {_put(kind[0], scope)} and len({name}) == {len(parts)}"
        return " and ".join([same, *parts])
    last = _put([None], scope)
    return f"({name} is {last}[0] or matches({name}, {_put(kind, scope)}, {last}))"


def _put(value: object, scope: dict[str, Any]) -> str:
    name = f"value{len(scope)}"
    scope[name] = value
    return name


def _matches(value: object, kind: object, last: list[object]) -> bool:
    """Say whether a value is of a kind, and remember it if so: most calls come with the same team."""
    found = kind_of(value) == kind
    if found:
        last[0] = value
    return found
