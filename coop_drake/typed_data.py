"""Frozen dataclasses from the plain data of YAML or JSON, by pydantic; all that departs is said at once.

The type of a field says what may stand there. ``Annotated`` adds :class:`Limits` to a number, a
:class:`Codec` to a type that stands in files as another one, such as the arrays of ``Vector``, and ``TAGGED``
to a union of dataclasses, which the mapping's entry ``_tag`` tells apart (in YAML the tag ``!ClassName``).
Scalars are strict: ``true`` is no number, and no text is one.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import MISSING, dataclass, make_dataclass
from difflib import get_close_matches
from functools import cache
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    NamedTuple,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pydantic import TypeAdapter
    from pydantic_core import ErrorDetails, SchemaValidator

T = TypeVar("T")
_cache: Any = cache
"""Typed so that types, too, may be arguments."""
Handler = Any
"""Pydantic's maker of schemas of inner types."""

LARGEST = 1e6
"""Largest magnitude of a number with limits [m, rad, s, N or unit of a gain]; beyond is a typing error."""

SCALARS = {bool: "true or false", int: "a whole number", float: "a finite number", str: "a text"}
"""Types of single values, and the words for them in messages."""


class DataError(ValueError):
    """A place where data departs from its type.

    Args:
        key: Dotted path of the key, for example ``start.joints.robot_0[1]``; empty for the whole.
        value: What stands there.
        allowed: What may stand there.
        others: Further departures of the same data.
    """

    def __init__(self, key: str, value: object, allowed: str, others: Iterable[DataError] = ()) -> None:
        self.key, self.value, self.allowed, self.others = key, value, allowed, tuple(others)
        lines = [f"{one.key}: {one.value!r} is not allowed; expected {one.allowed}" for one in self.all]
        super().__init__("\n".join(lines))

    @property
    def all(self) -> tuple[DataError, ...]:
        """This departure and the others."""
        return (self, *self.others)

    @property
    def faults(self) -> list[tuple[str, object, str]]:
        """Key, value and what is allowed of each of them."""
        return [(one.key, one.value, one.allowed) for one in self.all]

    def below(self, key: str) -> DataError:
        """The same departures, of data that stands at a key."""
        first, *rest = (DataError(below(key, one.key), one.value, one.allowed) for one in self.all)
        return DataError(first.key, first.value, first.allowed, rest)


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

    def describe(self, noun: str = "number") -> str:
        """What may stand there, in words."""
        if math.isfinite(self.at_least) and math.isfinite(self.at_most):
            return f"a {noun} between {self.at_least:g} and {self.at_most:g}"
        words = f"a {noun} of at least {self.at_least:g}" if self.at_least > -math.inf else f"a {noun}"
        words = f"zero or a positive {noun}" if self.at_least == 0.0 else words
        words = f"a positive {noun}" if self.above == 0.0 else words
        words += f", less than {self.below:g}" if self.below < math.inf else ""
        return words + (f", at most {self.at_most:g}" if self.at_most < math.inf else "")

    def __get_pydantic_core_schema__(self, source: Any, handler: Handler) -> Any:
        ends = {"gt": self.above, "ge": max(self.at_least, -LARGEST)}
        ends |= {"lt": self.below, "le": min(self.at_most, LARGEST)}
        kind = int if source is int else float
        return handler(source) | {name: kind(end) for name, end in ends.items() if math.isfinite(end)}


class _Exact:
    def __get_pydantic_core_schema__(self, source: Any, handler: Handler) -> Any:
        schema = handler(source)
        return {name: entry for name, entry in schema.items() if entry not in (LARGEST, -LARGEST)}


EXACT = _Exact()
"""Marks a number with limits that may exceed ``LARGEST``."""


class _Hidden:
    def __get_pydantic_core_schema__(self, source: Any, handler: Handler) -> Any:
        from pydantic_core import core_schema

        def refuse(value: object) -> None:
            raise ValueError

        return core_schema.no_info_plain_validator_function(refuse)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Handler) -> Any:
        from pydantic_core import PydanticOmit

        raise PydanticOmit


HIDDEN = _Hidden()
"""Marks a field that files do not have."""


class _Tagged:
    def __get_pydantic_core_schema__(self, source: Any, handler: Handler) -> Any:
        from pydantic_core import core_schema

        def choice(cls: type) -> Any:
            inner = handler.generate_schema(cls)
            return core_schema.no_info_before_validator_function(_without_tag, inner)

        choices = {f"!{cls.__name__}": choice(cls) for cls in get_args(source)}
        return core_schema.tagged_union_schema(choices, discriminator="_tag")

    def __get_pydantic_json_schema__(self, schema: Any, handler: Handler) -> Any:
        choices = []
        for tag, inner in schema["choices"].items():
            one = handler.resolve_ref_schema(handler(inner))
            tagged = {"_tag": {"const": tag}, **one["properties"]}
            choices.append({**one, "title": tag, "properties": tagged})
        return {"anyOf": choices}


def _without_tag(data: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in data.items() if name != "_tag"}


TAGGED = _Tagged()
"""Marks a union of dataclasses that the entry ``_tag``, ``!ClassName``, tells apart."""


@dataclass(frozen=True)
class Codec:
    """How a type stands in files.

    Attributes:
        kind: The type of what stands there.
        read: Makes the value of it; raises :class:`DataError` with a key below its own.
        write: Makes plain data of the value.
    """

    kind: Any
    read: Callable[[Any], Any]
    write: Callable[[Any], object]

    def __get_pydantic_core_schema__(self, source: Any, handler: Handler) -> Any:
        from pydantic_core import core_schema

        return core_schema.no_info_after_validator_function(self.read, handler.generate_schema(self.kind))


Number = float
"""A finite number of any size."""

Real = Annotated[float, Limits()]
Positive = Annotated[float, Limits(above=0.0)]
NotNegative = Annotated[float, Limits(at_least=0.0)]

Vector = Annotated[NDArray[np.float64], Codec(tuple[Number, ...], np.array, np.ndarray.tolist)]
"""A list of numbers in files, an array of shape (n,) in programs."""

Bound = Annotated[float, Limits(above=0.0), EXACT]
"""A largest magnitude; none is zero or negative."""


def _read_bounds(found: tuple[float | None, ...]) -> NDArray[np.float64]:
    return np.array([math.inf if bound is None else bound for bound in found], dtype=np.float64)


def _write_bounds(bounds: NDArray[np.float64]) -> object:
    return [bound if bound < math.inf else None for bound in bounds.tolist()]


Bounds = Annotated[NDArray[np.float64], Codec(tuple[Bound | None, ...], _read_bounds, _write_bounds)]
"""Largest magnitudes, an array of shape (n,) with infinity where there is none, which is null in files."""


class FieldType(NamedTuple):
    """Type of a field, with what ``Annotated`` adds, and its default, ``MISSING`` if it is required."""

    kind: Any
    default: Any


@_cache
def field_types(cls: Any) -> dict[str, FieldType]:
    """Return the fields of a dataclass by name, without those that are ``HIDDEN``."""
    hints = get_type_hints(cls, include_extras=True)
    shown = [field for field in dataclasses.fields(cls) if HIDDEN not in get_args(hints[field.name])]
    return {
        f.name: FieldType(hints[f.name], f.default if f.default_factory is MISSING else f.default_factory())
        for f in shown
    }


def classes_by_tag(kind: Any) -> dict[str, type]:
    """Return the dataclasses of a tagged union by their tags, ``!ClassName``; empty for another type."""
    tagged = get_origin(kind) is Annotated and TAGGED in get_args(kind)
    return {f"!{part.__name__}": part for part in get_args(get_args(kind)[0])} if tagged else {}


def below(key: str, name: object) -> str:
    """Return the key of an entry of the mapping or list that stands at ``key``."""
    joined = f"{key}{name}" if str(name).startswith("[") else f"{key}.{name}"
    return joined if key and name else key or str(name)


def convert(value: object, kind: Any, key: str = "") -> Any:
    """Convert plain data that stands at ``key`` to a type.

    A class with a function ``completed`` is given the mapping first, and returns it with what the class adds.

    Raises:
        DataError: All departures.
    """
    complete = getattr(kind, "completed", None) if isinstance(value, dict) else None
    return _validated(value if complete is None else complete(value), kind, kind, key)


def convert_class(value: object, cls: type[T]) -> T:
    """Convert a mapping to a dataclass, as :func:`convert` does."""
    result: T = convert(value, cls)
    return result


def check_fields(value: Any) -> None:
    """Check a dataclass that a program has made as one from a file is checked; for ``__post_init__``.

    Raises:
        DataError: All departures.
    """
    cls, names = type(value), field_types(type(value))
    _validated({name: getattr(value, name) for name in names}, _fields_alone(cls), cls, "")


@_cache
def _fields_alone(cls: Any) -> Any:
    """Return a dataclass of the same fields that checks nothing itself."""
    return make_dataclass(cls.__name__, [(name, field.kind) for name, field in field_types(cls).items()])


@_cache
def adapter(kind: Any) -> TypeAdapter[Any]:
    """Return pydantic's adapter of lists of a type; it takes no settings for a dataclass itself."""
    from pydantic import TypeAdapter

    return TypeAdapter(list[kind], config={"extra": "forbid", "allow_inf_nan": False})


@_cache
def _validator(kind: Any) -> SchemaValidator:
    from pydantic_core import SchemaValidator

    return SchemaValidator(_strict(adapter(kind).core_schema), {"allow_inf_nan": False})


def _strict(schema: Any) -> Any:
    """Return a schema by which no text is a number, and no number a truth value.

    Pydantic's own strictness, as a setting, would also refuse lists for tuples and mappings for dataclasses.
    """
    if isinstance(schema, list):
        return [_strict(part) for part in schema]
    if not isinstance(schema, dict):
        return schema
    own = {"strict": True} if schema.get("type") in ("bool", "int", "float", "str") else {}
    return {name: _strict(part) for name, part in schema.items()} | own


_NAMES = "one of the keys", "a text as the name"


def _validated(value: object, types: Any, kind: Any, key: str) -> Any:
    from pydantic_core import ValidationError

    try:
        return _validator(types).validate_python([value])[0]
    except ValidationError as error:
        found = [one for detail in error.errors() for one in _departures(detail, kind)]
    # A misspelt key explains the one that is missing.
    first, *others = sorted(found, key=lambda one: not one.allowed.startswith(_NAMES))
    raise DataError(first.key, first.value, first.allowed, others).below(key)


def _departures(detail: ErrorDetails, whole: Any) -> Iterator[DataError]:
    """Yield what an error of pydantic says, in the words of the types."""
    key, kind, around, value = "", whole, whole, detail["input"]
    if detail["type"] == "invalid_key" or detail["loc"][-1] == "[key]":
        *places, name = [step for step in detail["loc"][1:] if step != "[key]"]
        yield DataError(".".join(map(str, (*places, name))), name, "a text as the name")
        return
    short = detail["type"] == "missing" and isinstance(detail["loc"][-1], int)  # a list that is too short
    for step in detail["loc"][1 : -1 if short else None]:
        kind = _plain(kind)
        if step in classes_by_tag(kind):
            kind = classes_by_tag(kind)[str(step)]
            continue
        around, kind = kind, _inside(kind, step)
        key = f"{key}[{step}]" if isinstance(step, int) else below(key, step)
    error = detail.get("ctx", {}).get("error")
    if kind is None:
        names = list(field_types(around))
        near = get_close_matches(str(detail["loc"][-1]), names, 1)
        nearest = f"; did you mean {near[0]}?" if near else ""
        yield DataError(key, value, f"one of the keys {', '.join(names)}{nearest}")
    elif detail["type"] == "missing" and not short:
        yield DataError(key, None, "a value; this key is required")
    elif isinstance(error, DataError):
        yield from error.below(key).all
    elif type(value) in (int, float) and LARGEST < abs(value) < math.inf:
        yield DataError(key, value, f"a number between {-LARGEST:g} and {LARGEST:g}")
    else:
        tagged = isinstance(value, dict) and "_tag" in value and bool(classes_by_tag(_plain(kind)))
        beyond = detail["type"].startswith(("greater_than", "less_than"))
        allowed = describe(kind) if beyond else SCALARS.get(_plain(kind)) or describe(kind)
        yield DataError(key, value["_tag"] if tagged else value, allowed)


def _plain(kind: Any) -> Any:
    """Return the type of what stands in a file, without null."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return _plain(next(part for part in arguments if part is not type(None)))
    if origin is Annotated and TAGGED not in arguments:
        codec = next((extra for extra in arguments if isinstance(extra, Codec)), None)
        return _plain(codec.kind if codec else arguments[0])
    return kind


def _inside(kind: Any, step: str | int) -> Any:
    """Return the type of an entry, None for a key that a dataclass does not have."""
    if dataclasses.is_dataclass(kind):
        field = field_types(kind).get(str(step))
        return field and field.kind
    arguments = get_args(kind)
    return arguments[1] if get_origin(kind) is dict else arguments[0]


def describe(kind: Any, *, brief: bool = False) -> str:
    """What may stand where a type is expected, in words; brief without the keys of a section."""
    origin, arguments = get_origin(kind), get_args(kind)
    if kind in SCALARS:
        return SCALARS[kind]
    if tags := classes_by_tag(kind):
        return "a mapping with a tag, one of " + ", ".join(tags)
    if origin is Annotated:
        limits = next((extra for extra in arguments if isinstance(extra, Limits)), Limits())
        codec = next((extra for extra in arguments if isinstance(extra, Codec)), None)
        if codec or limits == Limits():
            return describe(codec.kind if codec else arguments[0], brief=brief)
        return limits.describe("whole number" if arguments[0] is int else "number")
    if origin is Literal:
        return "one of " + ", ".join(arguments)
    if origin in (Union, UnionType):
        return describe(arguments[0], brief=brief) + ", or null"
    if origin is tuple:
        size = "" if Ellipsis in arguments else f" of {len(arguments)}"
        return f"a list{size}, each entry {describe(arguments[0], brief=brief)}"
    if origin is dict:
        return f"a mapping from names to {describe(arguments[1], brief=brief)}"
    if not dataclasses.is_dataclass(kind):
        return "any value"
    return "a section" if brief else f"a mapping with the keys {', '.join(field_types(kind))}"


def to_plain(value: Any, kind: Any) -> Any:
    """Return the plain data of a typed value, without fields that are None; :func:`convert` reads it back."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType) and value is not None:
        return to_plain(value, arguments[0])
    codec = next((extra for extra in arguments if isinstance(extra, Codec)), None)
    if codec:
        return codec.write(value)
    if origin is tuple:
        return [to_plain(item, arguments[0]) for item in value]
    if origin is dict:
        return {name: to_plain(item, arguments[1]) for name, item in value.items()}
    if not dataclasses.is_dataclass(value):
        return value
    tag = {"_tag": f"!{type(value).__name__}"} if classes_by_tag(kind) else {}
    fields = [(name, getattr(value, name), field.kind) for name, field in field_types(type(value)).items()]
    return tag | {name: to_plain(entry, kind) for name, entry, kind in fields if entry is not None}
