"""Converts plain data of YAML or JSON into frozen dataclasses, and says where the data departs from them.

The type of a field says what may stand there: ``bool``, ``int``, ``float``, ``str``, ``Literal``, ``tuple``,
``dict`` with names as keys, a dataclass, any of these ``| None``, or a union of dataclasses, which the
mapping's entry ``_tag`` tells apart (in YAML the tag ``!ClassName``). ``Annotated`` adds :class:`Limits` or
``EXACT`` to a number, or a :class:`Codec` to a type that is none of these, such as the arrays of ``Vector``.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import MISSING, dataclass
from functools import cache
from numbers import Real
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")

LARGEST = 1e6
"""Largest magnitude of a number [m, rad, s, N or unit of a gain]; beyond is taken for a typing error."""

EXACT = "exact"
"""Marks a number that is written as JSON writes numbers, never as a text, and may exceed ``LARGEST``."""

SCALARS = {bool: "true or false", int: "a whole number", float: "a finite number", str: "a text"}
"""Types of single values, and the words for them in messages."""


class DataError(ValueError):
    """A place where data departs from its type.

    Args:
        key: Dotted path of the key, for example ``start.joints.robot_0[1]``; empty for the whole.
        value: What stands there.
        allowed: What may stand there.
    """

    def __init__(self, key: str, value: object, allowed: str) -> None:
        self.key, self.value, self.allowed = key, value, allowed
        super().__init__(f"{key}: {value!r} is not allowed; expected {allowed}")


@dataclass(frozen=True)
class Limits:
    """The interval that a number must lie in, besides that of ``LARGEST``.

    Attributes:
        above: The number must be larger.
        at_least: The number must be as large or larger.
        below: The number must be smaller.
        at_most: The number must be as small or smaller.
    """

    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    at_most: float = math.inf

    def contain(self, number: float) -> bool:
        """Whether a number lies in the interval."""
        return self.above < number < self.below and self.at_least <= number <= self.at_most

    def describe(self, noun: str = "number") -> str:
        """What may stand there, in words."""
        if math.isfinite(self.at_least) and math.isfinite(self.at_most):
            return f"a {noun} between {self.at_least:g} and {self.at_most:g}"
        words = f"a {noun} of at least {self.at_least:g}" if self.at_least > -math.inf else f"a {noun}"
        words = f"zero or a positive {noun}" if self.at_least == 0.0 else words
        words = f"a positive {noun}" if self.above == 0.0 else words
        words += f", less than {self.below:g}" if self.below < math.inf else ""
        return words + (f", at most {self.at_most:g}" if self.at_most < math.inf else "")


Positive = Annotated[float, Limits(above=0.0)]
NotNegative = Annotated[float, Limits(at_least=0.0)]
Number = Annotated[float, EXACT]


class Codec(NamedTuple):
    """How to read and write a type that this module does not know.

    Attributes:
        read: Makes the typed value of plain data and its key; raises :class:`DataError`.
        write: Makes the plain data of a typed value.
    """

    read: Callable[[object, str], Any]
    write: Callable[[Any], object]


class FieldType(NamedTuple):
    """Type of a field, with what ``Annotated`` adds, and its default, ``MISSING`` if it is required."""

    kind: Any
    default: Any


def field_types(cls: Any) -> dict[str, FieldType]:
    """Return the fields of a dataclass by name, without those whose metadata say ``in_file: False``."""
    return _field_types(cls)


@cache
def _field_types(cls: Any) -> dict[str, FieldType]:
    hints = get_type_hints(cls, include_extras=True)
    fields = [field for field in dataclasses.fields(cls) if field.metadata.get("in_file", True)]
    return {
        f.name: FieldType(hints[f.name], f.default if f.default_factory is MISSING else f.default_factory())
        for f in fields
    }


def classes_by_tag(kind: Any) -> dict[str, type]:
    """Return the dataclasses of a union by their tags, ``!ClassName``; empty for a type without tags."""
    classes = [part for part in get_args(kind) if isinstance(part, type) and dataclasses.is_dataclass(part)]
    tagged = get_origin(kind) in (Union, UnionType) and len(classes) > 1
    return {f"!{part.__name__}": part for part in classes} if tagged else {}


def below(key: str, name: object) -> str:
    """Return the key of an entry of the mapping that stands at ``key``."""
    return f"{key}.{name}" if key else str(name)


def convert_class(value: object, cls: type[T], key: str = "") -> T:
    """Convert a mapping to a dataclass; what the class itself refuses by a :class:`DataError`, too.

    A class with a function ``completed`` is given the mapping and its key first, and returns the mapping with
    what the class itself adds.

    Raises:
        DataError: The first departure.
    """
    fields = field_types(cls)
    names = ", ".join(fields)
    if not isinstance(value, dict):
        raise DataError(key, value, f"a mapping with the keys {names}")
    complete: Callable[[dict[str, Any], str], dict[str, Any]] | None = getattr(cls, "completed", None)
    content = value if complete is None else complete(value, key)
    for name in content:
        if name not in fields:
            raise DataError(below(key, name), content[name], f"one of the keys {names}")
    for name, field in fields.items():
        if field.default is MISSING and name not in content:
            raise DataError(below(key, name), None, "a value; this key is required")
    entries = {name: convert(item, fields[name].kind, below(key, name)) for name, item in content.items()}
    try:
        return cls(**entries)
    except DataError as error:  # Its key is relative to the class.
        raise DataError(below(key, error.key), error.value, error.allowed) from error


def check_fields(value: Any) -> None:
    """Check a dataclass that a program has made as one from a file is checked; for ``__post_init__``.

    Raises:
        DataError: The first departure.
    """
    for name, field in field_types(type(value)).items():
        convert(getattr(value, name), field.kind, name)


def convert(value: object, kind: Any, key: str = "") -> Any:
    """Convert plain data that stands at ``key`` to one of the types in the module's docstring.

    Raises:
        DataError: The first departure.
    """
    origin, arguments = get_origin(kind), get_args(kind)
    if kind in SCALARS:
        return _scalar(value, kind, key)
    if origin is Annotated:
        return _annotated(value, arguments[0], arguments[1:], key)
    if origin is Literal:
        if value not in arguments:
            raise DataError(key, value, "one of " + ", ".join(arguments))
        return value
    if origin is tuple:
        if not isinstance(value, list | tuple):
            raise DataError(key, value, "a list")
        if Ellipsis not in arguments and len(value) != len(arguments):
            raise DataError(key, value, f"a list of {len(arguments)}")
        return tuple(convert(item, arguments[0], f"{key}[{index}]") for index, item in enumerate(value))
    if origin is dict:
        if not isinstance(value, dict):
            raise DataError(key, value, "a mapping")
        for name in value:
            if not isinstance(name, str):
                raise DataError(below(key, name), name, "a text as the name")
        return {name: convert(item, arguments[1], below(key, name)) for name, item in value.items()}
    if origin in (Union, UnionType):
        return _union(value, kind, key)
    return convert_class(value, kind, key)


def _scalar(value: object, kind: type, key: str, *, exact: bool = False) -> bool | int | float | str:
    """Convert a single value; a number that is not exact may be a text: YAML 1.1 takes ``1e-3`` for one."""
    if kind is not float and kind is not int:
        if type(value) is not kind:
            raise DataError(key, value, SCALARS[kind])
        return value  # type: ignore[return-value]
    accepted: Any = (Real, str) if not exact else int if kind is int else (int, float)
    try:
        number = float(value) if isinstance(value, accepted) and not isinstance(value, bool) else math.nan
    except (ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number) or (kind is int and not number.is_integer()):
        raise DataError(key, value, SCALARS[kind])
    if abs(number) > LARGEST and not exact:
        raise DataError(key, value, f"a number between {-LARGEST:g} and {LARGEST:g}")
    return int(number) if kind is int else number


def _annotated(value: object, kind: Any, extras: tuple[Any, ...], key: str) -> Any:
    """Convert a number, or a value with a codec; limits of an array are those of its numbers."""
    coded = isinstance(extras[0], Codec)
    found: Any = extras[0].read(value, key) if coded else _scalar(value, kind, key, exact=EXACT in extras)
    for limits in [extra for extra in extras if isinstance(extra, Limits)]:
        arrayed = isinstance(found, np.ndarray)
        numbers = {f"{key}[{k}]": n for k, n in enumerate(found.tolist())} if arrayed else {key: found}
        for place, number in numbers.items():
            if not limits.contain(number):
                raise DataError(place, number, limits.describe("whole number" if kind is int else "number"))
    return found


def _union(value: object, kind: Any, key: str) -> Any:
    """Convert null or a value of one type; or a mapping to the dataclass that its tag names."""
    if tags := classes_by_tag(kind):
        content = dict(value) if isinstance(value, dict) else {}
        tag = content.pop("_tag", None)
        if tag not in tags:
            raise DataError(key, tag or value, "a mapping with a tag, one of " + ", ".join(tags))
        return convert_class(content, tags[tag], key)
    if value is None:
        return None
    try:
        return convert(value, next(part for part in get_args(kind) if part is not type(None)), key)
    except DataError as error:
        allowed = f"{error.allowed}, or null" if error.key == key else error.allowed
        raise DataError(error.key, error.value, allowed) from error


def to_plain(value: Any, kind: Any) -> Any:
    """Return the plain data of a typed value, without fields that are None; :func:`convert` reads it back."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType) and value is not None and not classes_by_tag(kind):
        return to_plain(value, next(part for part in arguments if part is not type(None)))
    if origin is Annotated and isinstance(arguments[1], Codec):
        return arguments[1].write(value)
    if origin is tuple:
        return [to_plain(item, arguments[0]) for item in value]
    if origin is dict:
        return {name: to_plain(item, arguments[1]) for name, item in value.items()}
    if not dataclasses.is_dataclass(value):
        return value
    tag = {"_tag": f"!{type(value).__name__}"} if classes_by_tag(kind) else {}
    fields = [(name, getattr(value, name), field.kind) for name, field in field_types(type(value)).items()]
    return tag | {name: to_plain(entry, kind) for name, entry, kind in fields if entry is not None}


def _read_vector(value: object, key: str) -> NDArray[np.float64]:
    return np.array(convert(value, tuple[Number, ...], key), dtype=np.float64)


Vector = Annotated[NDArray[np.float64], Codec(_read_vector, np.ndarray.tolist)]
"""A list of exact numbers in files, an array of shape (n,) in programs."""


Bound = Annotated[float, Limits(above=0.0), EXACT]
"""A largest magnitude; none is zero or negative."""


def _read_bounds(value: object, key: str) -> NDArray[np.float64]:
    found = convert(value, tuple[Bound | None, ...], key)
    return np.array([math.inf if bound is None else bound for bound in found], dtype=np.float64)


def _write_bounds(bounds: NDArray[np.float64]) -> object:
    return [bound if bound < math.inf else None for bound in bounds.tolist()]


Bounds = Annotated[NDArray[np.float64], Codec(_read_bounds, _write_bounds)]
"""Largest magnitudes, an array of shape (n,) with infinity where there is none, which is null in files."""
