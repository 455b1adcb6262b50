"""Scalars of a file, and the places where one departs from what must stand there."""

import math
from collections.abc import Iterator


class SchemaError(ValueError):
    """A place where a file departs from its schema.

    Args:
        key: Dotted path of the key.
        value: What stands there.
        allowed: What may stand there.
    """

    def __init__(self, key: str, value: object, allowed: str) -> None:
        self.key, self.value, self.allowed = key, value, allowed
        super().__init__(f"{key}: {value!r}; expected {allowed}")


Check = Iterator[SchemaError]

LARGEST = 1e6
"""Numbers beyond are slips of the pen in metres, radians, seconds and gains alike."""

SCALARS = {bool: "true or false", int: "a whole number", float: "a finite number", str: "a text"}
"""What may stand in a file for each type, in words."""


def check_scalar(value: object, kind: type, key: str) -> Check:
    """Yield what keeps a value from being a scalar of a type."""
    if kind is str or kind is bool:
        if type(value) is not kind:
            yield SchemaError(key, value, SCALARS[kind])
        return
    number = as_number(value)
    if number is None or not math.isfinite(number) or not (kind is float or number.is_integer()):
        yield SchemaError(key, value, SCALARS[kind])
    elif abs(number) > LARGEST:
        yield SchemaError(key, value, f"a number between {-LARGEST:g} and {LARGEST:g}")


def as_number(value: object) -> float | None:
    """A number as Drake would read it, None for anything else; YAML 1.1 takes ``1e-3`` for a text."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        return float(value)
    except ValueError:
        return None
    except OverflowError:
        return math.inf


def below(key: str, name: object) -> str:
    """The key of an entry of a mapping."""
    return f"{key}.{name}" if key else str(name)
