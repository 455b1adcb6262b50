"""Files that are malformed by construction: what was done to a sound one, and what a message must name."""

from __future__ import annotations

import copy
import io
import itertools
import json
import math
import random
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from typing import Any

import numpy as np

from coop_drake.answers.document import content_digest

Place = tuple[Any, ...]
NO_TEXT = (b"\xff", b"\xc3\x28", b"\xe2\x82", b"\xed\xa0\x80", b"\x80", b"\x00", b"\x1b")
"""Bytes that no text in UTF-8 holds, and control characters."""


@dataclass(frozen=True)
class Mutant:
    """A malformed file; the key is empty where the text itself is broken."""

    kind: str
    content: bytes
    key: str = ""


class Raw(str):
    """Text that goes into a file as it is."""


def flow(value: Any) -> str:
    """Plain data as one line of YAML; ``_tag`` becomes a tag."""
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, dict):
        pairs = (f"{json.dumps(key)}: {flow(one)}" for key, one in value.items() if key != "_tag")
        return f"{value.get('_tag', '')} {{{', '.join(pairs)}}}".strip()
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0.0 else "-.inf"
    return json.dumps(value)


def block(data: dict[str, Any]) -> str:
    """A whole file of YAML, one line for each section."""
    return "".join(f"{key}: {flow(value)}\n" for key, value in data.items())


def in_yaml(data: dict[str, Any]) -> bytes:
    return block(data).encode()


def in_json(data: Any) -> bytes:
    return json.dumps(data).encode()


def signed(document: dict[str, Any]) -> bytes:
    """In JSON with a digest of its own, which would not betray what was altered."""
    return in_json({**document, "digest": content_digest(document)} if "digest" in document else document)


def at(data: Any, path: Place) -> Any:
    """What stands at a place."""
    for step in path:
        data = data[step]
    return data


def put(data: Any, path: Place, value: Any) -> Any:
    """A copy with something else at a place, or something new; what is beside the way there is shared."""
    if not path:
        return value
    result = copy.copy(data)
    result[path[0]] = put(data[path[0]], path[1:], value) if len(path) > 1 else value
    return result


def without(data: Any, path: Place) -> Any:
    """A copy that lacks an entry."""
    return put(data, path[:-1], {k: one for k, one in at(data, path[:-1]).items() if k != path[-1]})


def dotted(path: Sequence[Any]) -> str:
    """A place as messages name it: ``start.joints.robot_0[1]``."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


def sampled(mutants: Iterable[Mutant], count: int, seed: int) -> list[Mutant]:
    """So many mutants at most, of every kind as many as of the others if there are enough."""
    rng, kinds = random.Random(seed), defaultdict[str, list[Mutant]](list)
    for mutant in mutants:
        kinds[mutant.kind.partition(" at ")[0]].append(mutant)
    for members in kinds.values():
        rng.shuffle(members)
    rounds = zip_longest(*kinds.values())
    return list(islice((mutant for row in rounds for mutant in row if mutant is not None), count))


def leaves(data: Any, path: Place = ()) -> Iterator[tuple[Place, Any]]:
    """Every value with its place, mappings and lists before what is in them."""
    yield path, data
    pairs = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for step, value in pairs:
        yield from leaves(value, (*path, step))


WRONG: tuple[tuple[type | tuple[type, ...], tuple[Any, ...]], ...] = (
    (bool, ("maybe", 3, [True])),
    ((int, float), ("wide", True, [1.0], {"metres": 1.0}, math.nan, math.inf, -math.inf)),
    (str, (3, False, ["text"], {"text": 1})),
    (list, ("wide", 3.0, {"0": 1})),
    (dict, ("wide", 3.0, [1])),
)
"""Values of other types, by the type of what they stand for."""


def typed_mutants(data: dict[str, Any], write=in_yaml, *, skip=(), required=False) -> Iterator[Mutant]:
    """Values of another type, unknown keys and, where all are required, missing ones, at every place.

    Args:
        data: A sound document.
        write: Turns a document into a file.
        skip: Keys below which nothing is changed.
        required: Whether every key is.
    """
    for place, value in leaves(data):
        if any(step in skip for step in place) or "_tag" in place:
            continue
        if isinstance(value, dict):
            unknown = (*place, "colour")
            yield Mutant(f"unknown key at {unknown}", write(put(data, unknown, "red")), dotted(unknown))
            for name in value if required else ():
                if name not in skip:
                    here = (*place, name)
                    yield Mutant(f"missing key at {here}", write(without(data, here)), dotted(here))
        if place and value is not None:
            others = next(others for kind, others in WRONG if isinstance(value, kind))
            for other in others:
                kind = f"{other} for {type(value).__name__} at {dotted(place)}"
                yield Mutant(kind, write(put(data, place, other)), dotted(place))


def broken_text(
    content: bytes, count: int, seed: int, key: str = "", end: int | None = None
) -> Iterator[Mutant]:
    """Files that are cut off before an end, and with bytes between that are no text."""
    rng = random.Random(seed)
    for place in rng.sample(range(1, len(content) if end is None else end), count):
        yield Mutant(f"cut off at {place}", content[:place], key)
    for number in range(count):
        place, junk = rng.randrange(len(content) + 1), NO_TEXT[number % len(NO_TEXT)]
        yield Mutant(f"{junk!r} at {place}", content[:place] + junk + b" " + content[place:])
    for name in ("utf-16", "utf-32"):
        yield Mutant(f"as {name}", content.decode().encode(name))
    yield Mutant("a picture", b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    yield Mutant("empty", b"", key)


def yaml_mutants(data: dict[str, Any], seed: int) -> Iterator[Mutant]:
    """Broken YAML of a scenario, and YAML without end: repeated keys, code, nesting, aliases of aliases."""
    text = block({key: value for key, value in data.items() if key != "planner"})  # the mutants' own section
    yield from broken_text(text.encode(), 50, seed, end=text.index("goal:"))
    for kind, content in (
        ("a repeated key", text + '"goal": 3\n'),
        ("two documents", text + "---\n" + text),
        ("tabs", text.replace("goal: ", "goal:\n\t")),
        ("an open bracket", text + "planner: {margin: 0.1\n"),
        ("a bracket too many", text + "planner: {margin: 0.1}}\n"),
        ("an open quote", text + 'planner: {strategy: "cells}\n'),
        ("a key without a colon", text + "planner\n"),
        ("an object of Python", text + "planner: !!python/object/apply:os.getcwd []\n"),
        ("a key of Python", text + "!!python/name:os.system planner: {}\n"),
        ("an unknown tag", text.replace("goal: ", "goal: !Target ")),
        ("an alias of nothing", text + "planner: *settings\n"),
        ("a merge of nothing", text + "planner: {<<: 3}\n"),
        ("a mapping as a key", text + "{a: 1}: {margin: 0.1}\n"),
        ("a date as a number", text + "planner: {margin: 2024-02-30}\n"),
        ("no binary", text + "planner: !!binary '*'\n"),
        ("a set", text + "planner: !!set {margin}\n"),
        ("a directive", "%YAML 9.9\n---\n" + text + "plan: 1\n"),
        *((f"{depth} lists", text + f"planner: {'[' * depth}{']' * depth}\n") for depth in (100, 200_000)),
        *(
            (f"{depth} maps", text + "planner: " + "{a: " * depth + "1" + "}" * depth)
            for depth in (100, 20_000)
        ),
        ("900 indented mappings", text + "plan:\n" + "".join(f"{' ' * k}a:\n" for k in range(1, 900))),
        *(
            ("it holds itself", text + f"planner: {own}\n")
            for own in ("&a [*a]", "&a {a: *a}", "&a {<<: *a}")
        ),
    ):
        yield Mutant(kind, content.encode())
    names = "abcdefghijklmnopqrst"
    for first, many in (("[0]", "[{}]"), ("{x: 1}", "{{k: [{}]}}"), ("{x: 1}", "{{<<: [{}]}}")):
        bomb = f"_a: &a {first}\n"
        for one, other in itertools.pairwise(names):
            bomb += f"_{other}: &{other} {many.format(', '.join([f'*{one}'] * 9))}\n"
        yield Mutant(f"bomb of {many}", (bomb + text).encode())
        used = bomb + text.replace("goal: ", "planner: {margin: *t}\ngoal: ")
        yield Mutant(f"bomb of {many} as a number", used.encode())


def json_mutants(document: dict[str, Any], seed: int) -> Iterator[Mutant]:
    """Broken JSON, JSON of something else, and heads of other files."""
    text = json.dumps(document)
    yield from broken_text(text.encode(), 20, seed)
    for kind, content in (
        ("a list", "[]"),
        ("nothing", "null"),
        ("an empty mapping", "{}"),
        ("two documents", text + text),
        ("single quotes", text.replace('"', "'")),
        ("a comment", text[:-1] + "// done\n}"),
        ("a repeated key", text[:-1] + f', "{next(iter(document))}": 1}}'),
        ("YAML", "format: coop_drake plan\n"),
        ("100000 lists", "[" * 100_000 + "]" * 100_000),
        ("100000 mappings", '{"a":' * 100_000 + "1" + "}" * 100_000),
        ("a number without end", text[:-1] + ', "colour": ' + "9" * 5_000 + "}"),
    ):
        yield Mutant(f"{kind} as a file", content.encode())
    for name, values in (("format", ("coop_drake plan 2", "", "plan")), ("version", (0, 1.5, 99, "2", -1))):
        for value in values:
            yield Mutant(f"another {name}", signed({**document, name: value}), name)


def log_mutants(content: bytes, seed: int) -> Iterator[Mutant]:
    """Malformed copies of a sound ``.npz`` file."""

    def archive(arrays: dict[str, np.ndarray]) -> bytes:
        stream = io.BytesIO()
        np.savez_compressed(stream, **arrays)
        return stream.getvalue()

    for place in random.Random(seed).sample(range(len(content) - 22), 20):
        yield Mutant(f"cut off at {place}", content[:place])
    yield Mutant("text", b"times: [0, 1]\n")
    yield Mutant("an empty archive", archive({}), "times")
    with np.load(io.BytesIO(content)) as read:
        arrays = {name: read[name] for name in read.files}
    for name, array in arrays.items():
        rest = {key: value for key, value in arrays.items() if key != name}
        yield Mutant(f"missing {name}", archive(rest), name)
        yield Mutant(f"misspelt {name}", archive({**rest, f"{name}_": array}), name)
        if array.dtype.kind in "fi":
            yield Mutant(f"words in {name}", archive({**rest, name: np.full(array.shape, "wide")}), name)
            yield Mutant(f"{name} of four axes", archive({**rest, name: array.reshape(-1, 1, 1, 1)}), name)
            if name != "times":
                yield Mutant(f"a row too few in {name}", archive({**rest, name: array[:-1]}), name)
