"""Files whose text is broken, whatever it says: encodings, cuts, repetitions, nesting, YAML bombs."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from typing import Any

from tests.support.mutants.mutant import Mutant, Raw, block, dotted, leaves, put

_CONTROLS = b"\x00\x01\x07\x1b\x08"
_NO_UTF_8 = (
    b"\xff",
    b"\xfe\xff",
    b"\xc3\x28",
    b"\xe2\x82",
    b"\xf5\x80\x80\x80",
    b"\xed\xa0\x80",
    b"\xc0\xaf",
    b"\x80",
)


def encoding_mutants(content: bytes, places: int, seed: int) -> Iterator[Mutant]:
    """Bytes that are no UTF-8 anywhere in a file, and control characters that no text has."""
    rng = random.Random(seed)
    for number in range(places):
        place = rng.randrange(len(content) + 1)
        junk = _NO_UTF_8[number % len(_NO_UTF_8)]
        # Behind it comes nothing that could complete it.
        broken = content[:place] + junk + b" " + content[place:]
        yield Mutant("no UTF-8", f"byte {place}", "these bytes encode no text", broken)
        control = _CONTROLS[number % len(_CONTROLS) : number % len(_CONTROLS) + 1]
        broken = content[:place] + control + content[place:]
        yield Mutant("control character", f"byte {place}", "no text has such a character", broken)
    text = content.decode()
    for name in ("utf-16", "utf-32"):
        yield Mutant(f"as {name}", "the file", "the format is UTF-8", text.encode(name))
    yield Mutant("a picture", "the file", "it is no text", b"\x89PNG\r\n\x1a\n" + bytes(range(256)))
    yield Mutant(
        "an archive", "the file", "it is no text", b"PK\x03\x04\x14\x00\x08\x08" + bytes(range(128, 256))
    )


def yaml_mutants(data: dict[str, Any], seed: int) -> Iterator[Mutant]:
    """Broken YAML of a scenario."""
    rng = random.Random(seed)
    text = block(data)
    goal = text.index("goal:")
    for place in sorted(rng.sample(range(1, goal), 60)):
        yield Mutant("cut off", f"byte {place}", "the required goal is gone", text[:place].encode())
    for path, value in leaves(data):
        if isinstance(value, dict) and value and "_tag" not in value:
            name = next(iter(value))
            twice = {**value, Raw(f'"{name}"'): value[name]}
            changed = block(put(data, path, twice)) if path else text + f'"{name}": {Raw("3")}\n'
            yield Mutant("repeated key", dotted((*path, name)), "it says two things", changed.encode())
    yield from _whole_files(text)
    yield from _nested(data)
    yield from _bombs(text)


def _whole_files(text: str) -> Iterator[Mutant]:
    for kind, content, because in (
        ("empty", "", "it says nothing"),
        ("blank", "\n\n   \n", "it says nothing"),
        ("only a comment", "# to be written\n", "it says nothing"),
        ("a list", "- workspace\n- directives\n", "a scenario is a mapping"),
        ("a number", "42\n", "a scenario is a mapping"),
        ("a sentence", "two robots carry a box\n", "a scenario is a mapping"),
        ("two documents", text + "---\n" + text, "a scenario is one document"),
        ("markup", "<scenario><workspace/></scenario>\n", "it is no YAML mapping"),
        ("tabs", text.replace("goal: ", "goal:\n\t"), "YAML does not indent with tabs"),
        ("an open bracket", text + "planner: {margin: 0.1\n", "the bracket never closes"),
        ("a bracket too many", text + "planner: {margin: 0.1}}\n", "nothing was opened"),
        ("an open quote", text + 'planner: {strategy: "cells}\n', "the quote never closes"),
        ("a key without a colon", text + "planner\n", "it has no value"),
        ("an object of Python", text + "planner: !!python/object/apply:os.getcwd []\n", "no code in data"),
        ("a key of Python", text + "!!python/name:os.system planner: {}\n", "no code in data"),
        ("an unknown tag", text.replace("goal: ", "goal: !Target "), "a goal has no kinds"),
        ("a tag for a list", text.replace("directives: ", "directives: !Team "), "directives have no kinds"),
        ("an alias of nothing", text + "planner: *settings\n", "nothing has this name"),
        ("a merge of nothing", text + "planner: {<<: 3}\n", "only mappings merge"),
        ("a number as a key", text + "3: {margin: 0.1}\n", "no key has this name"),
        ("a list as a key", text + "[1, 2]: {margin: 0.1}\n", "no key has this name"),
        ("a mapping as a key", text + "{a: 1}: {margin: 0.1}\n", "no key has this name"),
        ("a date as a number", text + "planner: {margin: 2024-02-30}\n", "it is no number"),
        ("a date that is none", text + "planner: {margin: 2024-02-30 10:00:00}\n", "it is no number"),
        ("sexagesimal junk", text + "planner: {margin: 1:2:x}\n", "it is no number"),
        ("no binary", text + "planner: !!binary '*'\n", "it is a mapping"),
        ("a set", text + "planner: !!set {margin}\n", "a margin needs a value"),
        ("a directive of YAML", "%YAML 9.9\n---\n" + text + "plan: 1\n", "no YAML has this version"),
        ("a directive of nothing", "%TAG\n---\n" + text, "it is incomplete"),
        ("a version", text + "version: 99\n", "scenarios have no version"),
    ):
        yield Mutant(f"{kind} as a file", "the file", because, content.encode())


def _nested(data: dict[str, Any]) -> Iterator[Mutant]:
    for depth in (100, 1_000, 20_000, 200_000):
        for kind, value in (
            ("lists", "[" * depth + "]" * depth),
            ("mappings", "{a: " * depth + "1" + "}" * depth),
        ):
            because = "nothing of it is so deep"
            for path in (("planner",), ("workspace", "outer"), ("start", "object", "x")):
                changed = block(put(data, path, Raw(value)))
                yield Mutant(f"{depth} {kind} in each other", dotted(path), because, changed.encode())
    deep = "".join(f"{' ' * k}a:\n" for k in range(1, 900))
    yield Mutant(
        "900 indented mappings",
        "planner",
        "nothing of it is so deep",
        (block(data) + f"plan:\n{deep}").encode(),
    )


def _bombs(text: str) -> Iterator[Mutant]:
    because = "nothing needs so many repetitions"
    names = "abcdefghijklmnopqrst"
    lists = "a: &a [0, 0, 0, 0, 0, 0, 0, 0, 0]\n"
    lists += "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in itertools.pairwise(names))
    maps = "a: &a {x: 1, y: 2}\n"
    for a, b in itertools.pairwise(names):
        maps += f"{b}: &{b} {{" + ", ".join(f"k{k}: *{a}" for k in range(9)) + "}\n"
    merges = "a: &a {x: 1}\n"
    for a, b in itertools.pairwise(names):
        merges += f"{b}: &{b} {{<<: [{', '.join([f'*{a}'] * 9)}]}}\n"
    for kind, bomb in (("lists", lists), ("mappings", maps), ("merged mappings", merges)):
        yield Mutant(f"bomb of {kind}", "the file", because, (text + bomb).encode())
        hidden = "_library:\n" + "".join(f"  {line}\n" for line in bomb.splitlines())
        used = hidden + text.replace("goal: ", "planner: {margin: *t}\ngoal: ")
        yield Mutant(f"bomb of {kind} in a template", "planner.margin", because, used.encode())
        outer = "workspace: {outer: *t}\n"
        yield Mutant(
            f"bomb of {kind} as a floor",
            "workspace",
            because,
            (hidden + outer + text[text.index("\n") + 1 :]).encode(),
        )
    for kind, value in (("list", "&a [*a]"), ("mapping", "&a {a: *a}"), ("merged mapping", "&a {<<: *a}")):
        yield Mutant(
            f"{kind} that holds itself", "planner", "it has no end", (text + f"planner: {value}\n").encode()
        )
