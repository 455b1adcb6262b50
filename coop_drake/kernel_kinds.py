"""The kind of an argument, by which the versions of a compiled function are told apart."""

from __future__ import annotations

from typing import Any

import numpy as np

_LAYOUT = 0x1 | 0x2 | 0x100
"""Bits of numpy's flags for what machine code reads: C order, Fortran order, aligned."""

ARRAY_FLAGS = _LAYOUT | 0x400
"""Bits of numpy's flags that machine code depends on; the last one: writable."""

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


def layout_of(value: Any) -> object:
    """Return the kind of a value but for whether an array may be written to, which is no matter of memory."""
    if isinstance(value, np.ndarray):
        return value.dtype, value.ndim, value.flags.num & _LAYOUT
    return kind_of(value)


def words_of(kind: object) -> str | None:
    """Return a kind as a text that is the same in every process; None for what is not kept."""
    if isinstance(kind, str):
        return kind
    if not isinstance(kind, tuple):
        return None
    first, *rest = kind
    if isinstance(first, np.dtype):
        dimensions, flags = rest
        order = "C" if flags & 0x1 else "F" if flags & 0x2 else "A"
        return f"{first.str}{dimensions}{order}{flags & 0x500:x}" if first.kind in "fiub" else None
    parts = [words_of(part) for part in rest]
    if None in parts:
        return None
    names = getattr(first, "_fields", "")
    return f"{first.__module__}.{first.__qualname__}{names}({', '.join(map(str, parts))})"
