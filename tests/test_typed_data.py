"""Plain data becomes typed values and back; every limit that is stated is the one that is checked."""

import dataclasses
import math
from typing import Annotated, get_args, get_origin

import pytest

from coop_drake.laws.gains import AxisGains
from coop_drake.scenario import Scenario
from coop_drake.typed_data import (
    EXACT,
    LARGEST,
    TAGGED,
    DataError,
    Limits,
    Positive,
    Vector,
    check_fields,
    convert,
    convert_class,
    field_types,
    to_plain,
)


@dataclasses.dataclass(frozen=True)
class Disc:
    radius: Positive = 1.0

    def __post_init__(self):
        check_fields(self)


@dataclasses.dataclass(frozen=True)
class Box:
    edges: tuple[float, float]
    filled: bool = False
    name: str | None = None


@dataclasses.dataclass(frozen=True)
class Floor:
    shapes: dict[str, Annotated[Disc | Box, TAGGED]]
    count: int = 0


FLOOR = {"shapes": {"a": {"_tag": "!Disc", "radius": 2}, "b": {"_tag": "!Box", "edges": [0.1, 2]}}}


def test_data_becomes_values_and_data_again():
    floor = convert_class(FLOOR, Floor)
    assert floor == Floor({"a": Disc(2.0), "b": Box((0.1, 2.0))})
    assert convert_class(to_plain(floor, Floor), Floor) == floor


@pytest.mark.parametrize(
    ("data", "key", "allowed"),
    [
        ([], "", "a mapping with the keys shapes, count"),
        ({}, "shapes", "this key is required"),
        ({**FLOOR, "colour": 1}, "colour", "one of the keys shapes, count"),
        ({**FLOOR, "count": 1.5}, "count", "a whole number"),
        ({"shapes": {"a": {"radius": 1}}}, "shapes.a", "one of !Disc, !Box"),
        ({"shapes": {"a": {"_tag": "!Disc", "radius": -1}}}, "shapes.a.radius", "a positive number"),
        ({"shapes": {"a": {"_tag": "!Box", "edges": [1]}}}, "shapes.a.edges", "a list of 2"),
        ({"shapes": {"a": {"_tag": "!Box", "edges": [1, True]}}}, "shapes.a.edges[1]", "a finite number"),
        ({"shapes": {3: {}}}, "shapes.3", "a text as the name"),
    ],
)
def test_a_departure_is_refused_with_its_place(data, key, allowed):
    with pytest.raises(DataError) as caught:
        convert_class(data, Floor)
    assert caught.value.key == key
    assert allowed in caught.value.allowed


def test_all_departures_are_said_at_once_with_the_nearest_name():
    """A misspelt key comes first: it explains what is missing."""
    with pytest.raises(DataError) as caught:
        convert_class({"shpes": {}, "count": True}, Floor)
    assert [one.key for one in caught.value.all] == ["shpes", "shapes", "count"]
    assert caught.value.allowed == "one of the keys shapes, count; did you mean shapes?"
    assert str(caught.value).count("is not allowed") == 3


def test_what_a_class_refuses_is_refused_where_it_stands():
    with pytest.raises(DataError, match=r"^radius: 0.0 is not allowed; expected a positive number$"):
        Disc(0.0)


@pytest.mark.parametrize(
    ("kind", "value", "key"),
    [
        (Annotated[Positive, EXACT], "1.0", "a"),
        (Annotated[Positive, EXACT], True, "a"),
        (Annotated[Positive, EXACT], 0.0, "a"),
        (Annotated[int, EXACT], 1.0, "a"),
        (Annotated[int, EXACT], math.inf, "a"),
        (AxisGains, [1.0, -1.0], "a[1]"),
        (AxisGains, [1.0, "2.0"], "a[1]"),
        (Vector, [[1.0]], "a[0]"),
        (Vector, [1.0, math.nan], "a[1]"),
        (Vector, [math.inf], "a[0]"),
        (Vector, 1.0, "a"),
    ],
)
def test_exact_numbers_are_numbers_of_json_of_any_size(kind, value, key):
    assert convert(1e300, Annotated[Positive, EXACT]) == 1e300
    assert to_plain(convert([1, 1e300], Vector), Vector) == [1.0, 1e300]
    with pytest.raises(DataError) as caught:
        convert(value, kind, "a")
    assert caught.value.key == key


def limited(cls, path=""):
    """Every number of a scenario file that has limits: its place and its type."""
    for name, field in field_types(cls).items():
        for kind in (field.kind, *get_args(field.kind)):
            if get_origin(kind) is Annotated and isinstance(get_args(kind)[1], Limits):
                yield f"{path}{name}", kind
            elif dataclasses.is_dataclass(kind):
                yield from limited(kind, f"{path}{name}.")


LIMITED = dict(limited(Scenario))


@pytest.mark.parametrize("key", LIMITED)
def test_numbers_are_refused_beyond_their_limits_alone(key):
    number, limits = get_args(LIMITED[key])
    for end, inwards in ((limits.at_least, 1), (limits.at_most, -1), (limits.above, 1), (limits.below, -1)):
        closed = end in (limits.at_least, limits.at_most)
        if math.isfinite(end):
            step = 1 if number is int else 1e-3 * min(1.0, limits.below)
            beyond, inside = (end - inwards * step, end) if closed else (end, end + inwards * step)
            assert convert(inside, LIMITED[key], key) == inside
            with pytest.raises(DataError) as caught:
                convert(beyond, LIMITED[key], key)
            assert (caught.value.key, caught.value.value) == (key, beyond)
    for far in (LARGEST + 1, -LARGEST - 1, math.nan, math.inf):
        with pytest.raises(DataError):
            convert(far, LIMITED[key], key)


def test_sizes_times_and_rates_have_limits():
    assert {"goal.tolerances.position", "planner.max_slices", "deployment.messages.loss"} <= set(LIMITED)
    assert len(LIMITED) >= 24
