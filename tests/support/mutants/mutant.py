"""One malformed file beside what is sound, and why it is malformed; plain data as YAML or JSON text."""

from __future__ import annotations

import copy
import json
import math
import random
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from typing import Any

Place = tuple[Any, ...]


@dataclass(frozen=True)
class Mutant:
    """A file that is malformed by construction.

    Attributes:
        kind: What was done to it.
        place: Where.
        because: Why nothing that is done so can be meant.
        content: The file.
        key: What the message must name; empty where the text itself is broken.
    """

    kind: str
    place: str
    because: str
    content: bytes
    key: str = ""


class Raw(str):
    """Text that goes into a file as it is."""


def flow(value: Any) -> str:
    """Plain data as one line of YAML; ``_tag`` becomes a tag."""
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, dict):
        pairs = (f"{key if isinstance(key, Raw) else json.dumps(key)}: {flow(v)}" for key, v in value.items())
        tag = value.get("_tag")
        if tag is not None:
            pairs = (f"{json.dumps(key)}: {flow(v)}" for key, v in value.items() if key != "_tag")
        return (f"{tag} " if tag else "") + "{" + ", ".join(pairs) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0.0 else "-.inf"
    return json.dumps(value)


def block(data: dict[str, Any]) -> str:
    """A whole file, one line for each section."""
    return "".join(f"{key}: {flow(value)}\n" for key, value in data.items())


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
    mapping = dict(at(data, path[:-1]))
    del mapping[path[-1]]
    return put(data, path[:-1], mapping)


def renamed(data: Any, path: Place, name: str) -> Any:
    """A copy in which a key has another name, in the same place of its mapping."""
    mapping = at(data, path[:-1])
    return put(data, path[:-1], {(name if key == path[-1] else key): value for key, value in mapping.items()})


def dotted(path: Sequence[Any]) -> str:
    """A place as messages name it: ``start.joints.robot_0[1]``."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}" if text else str(step)
    return text


def sampled(mutants: Iterable[Mutant], count: int, seed: int) -> list[Mutant]:
    """So many mutants at most, of every kind as many as of the others if there are enough."""
    rng, kinds = random.Random(seed), defaultdict[str, list[Mutant]](list)
    for mutant in mutants:
        kinds[mutant.kind].append(mutant)
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
