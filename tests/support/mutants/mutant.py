"""One malformed file beside what is sound, why it is malformed, and what a command must answer to it."""

from __future__ import annotations

import copy
import io
import json
import math
import random
import shutil
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any

import typer

from coop_drake.cli import app

Place = tuple[Any, ...]
COMMAND = typer.main.get_command(app)
REMEDY = "; expected "


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


def faults(
    mutant: Mutant, file: Path, arguments: Sequence[str], out: Path, remedy: str = REMEDY
) -> list[str]:
    """What is wrong with the answer to a mutant; nothing if it is as it should be.

    Args:
        mutant: Its content is written to the file.
        file: Where the command finds it.
        arguments: The command; ``--json`` and ``--out`` are added.
        out: Where results would go; it must not come to be.
        remedy: What stands before the words that help.
    """
    shutil.rmtree(out, ignore_errors=True)
    file.unlink(missing_ok=True)  # Some file systems write a file that is truncated to the disk at once.
    file.write_bytes(mutant.content)
    before = sorted(file.parent.iterdir())
    said, complained = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(complained):
            code = COMMAND.main([*arguments, "--json"], standalone_mode=False)
    except BaseException as error:
        return [f"raised {type(error).__name__}: {str(error)[:200]}"]
    found = [] if code == 2 else [f"exit code {code}"]
    lines = complained.getvalue().splitlines()
    if not lines or not lines[0].startswith("Error: "):
        found.append(f"standard error has {len(lines)} lines: {complained.getvalue()[:300]!r}")
    answers = said.getvalue().splitlines()
    message = json.loads(answers[-1]).get("error", "") if answers else ""
    if len(answers) != 1 or not message:
        found.append(f"standard output is no single JSON object with an error: {said.getvalue()[:200]!r}")
    if file.name not in message:
        found.append("the file is not named")
    if mutant.key not in message:
        found.append(f"the key {mutant.key} is not named")
    if remedy not in message:
        found.append("no remedy")
    if len(message) > 2000:
        found.append(f"the message has {len(message)} characters")
    if not all(file.name in line and remedy in line for line in message.splitlines()):
        found.append("a line of the message does not name the file and a remedy")
    if lines != f"Error: {message}".splitlines():
        found.append("standard error says something else")
    if out.exists() or sorted(file.parent.iterdir()) != before:
        found.append("something was written")
    return [f"{fault} -- {message[:240]}" for fault in found]
