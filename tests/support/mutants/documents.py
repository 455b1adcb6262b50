"""Plans, proofs and logs that are malformed: keys, lengths, numbers, shapes and arrays amiss."""

from __future__ import annotations

import io
import json
import random
import zipfile
from collections.abc import Iterator
from typing import Any

import numpy as np

from coop_drake.answers.digest import content_digest
from tests.support.mutants.mutant import Mutant, Place, at, dotted, leaves, put, renamed, without

Document = dict[str, Any]
_FREE = ("gain_set", "problem", "digest", "goal_joints")
_OPTIONAL = ("squeezes",)
"""Keys that files of older versions do not have."""

_FIXED_LENGTH = [
    "start",
    "goal_pose",
    "target",
    "goal_lower",
    "goal_upper",
    "lower",
    "upper",
    "decay_rate",
    "log_gain",
    "energy_bound",
    "centre",
    "goal_joints",
    "transitions",
]
_POSITIVE = [
    "stiffness",
    "damping",
    "governor_gain",
    "position_gain",
    "rate_gain",
    "saturation",
    "inradius",
    "neck",
    "radius",
]
_NOT_NEGATIVE = [
    "margin",
    "length",
    "estimated_time",
    "smoothing",
    "ramp_rate",
    "hand_over_time",
    "component",
]


def document_mutants(document: Document, every: int = 1) -> Iterator[Mutant]:
    """Malformed copies of a sound document, each signed anew: its digest alone would not betray it.

    Args:
        document: The document.
        every: At every so many of its places; the shape of what stands there may be that of its neighbours.
    """
    for number, (place, value) in enumerate(leaves(document)):
        if not place or place == ("digest",) or (number % every and len(place) > 2):
            continue
        name = next((step for step in reversed(place) if isinstance(step, str)), "")
        for kind, wrong, because in _wrong(place, name, value):
            shared = name in ("lower", "upper", "goal_joints")  # Lengths that two of them disagree on.
            key = dotted(place[: place.index(name)] if shared else place)
            yield Mutant(kind, dotted(place), because, _signed(put(document, place, wrong)), key)
        yield from _of_mapping(document, place, value)
    yield from _of_mapping(document, (), document)
    yield from _heads(document)


def _wrong(place: Place, name: str, value: Any) -> Iterator[tuple[str, Any, str]]:
    """Values of another type or out of range."""
    if isinstance(value, bool):
        for wrong in (0, "yes", None):
            yield f"{wrong!r} for a truth", wrong, "it is true or false"
    elif isinstance(value, int | float):
        for wrong in (float("nan"), float("inf"), -float("inf"), "1.0", True, [value], {}, 10**400):
            yield f"{str(wrong)[:8]} for a number", wrong, "it is a finite number"
        if name not in _FREE:
            yield "nothing for a number", None, "it is a finite number"
        if name in _POSITIVE:
            yield "not positive", 0.0, "it is a size or a gain"
        if name in (*_POSITIVE, *_NOT_NEGATIVE):
            yield "negative", -1.0, "it is a size or a gain"
    elif isinstance(value, str):
        for wrong in (3, None, [value], {value: 1}):
            yield f"{str(wrong)[:8]} for a text", wrong, "it is a text"
    elif isinstance(value, list):
        for wrong in ("none", 3.0, None, {"0": 1}):
            yield f"{wrong!r} for a list", wrong, "it is a list"
        if name in _FIXED_LENGTH and isinstance(place[-1], str):
            yield "an entry too few", value[:-1], "its length is that of the others"
            yield "an entry too many", [*value, value[-1]], "its length is that of the others"
            yield "nothing in it", [], "its length is that of the others"
    elif isinstance(value, dict):
        for wrong in ("none", 3.0, None, [value]):
            yield f"{str(wrong)[:8]} for a mapping", wrong, "it is a mapping"
        if "outer" in value:
            yield from _shapes(value)


def _shapes(polygon: dict[str, Any]) -> Iterator[tuple[str, Any, str]]:
    ring = polygon["outer"]
    (x, y), (a, b) = ring[0], ring[1]
    middle = [0.5 * (x + a), 0.5 * (y + b)]
    for kind, outer, because in (
        ("no corners", [], "it encloses nothing"),
        ("two corners", ring[:2], "it encloses nothing"),
        ("corners in a line", [ring[0], middle, ring[1]], "it encloses nothing"),
        ("one corner many times", [ring[0]] * 4, "it encloses nothing"),
        ("spike", [ring[0], [x + 0.3, y + 0.4], *ring], "it runs to a point and back"),
        ("bow tie", [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]], "its diagonals cross"),
        ("corner of three", [[*ring[0], 0.0], *ring[1:]], "a corner is x and y"),
        ("corner of none", [[], *ring[1:]], "a corner is x and y"),
    ):
        yield kind, {**polygon, "outer": outer}, because
    far = [[x + 1e4, y], [x + 1e4 + 1.0, y], [x + 1e4, y + 1.0]]
    yield "hole outside", {**polygon, "holes": [far]}, "there is nothing to take away"
    yield "hole as large as all", {**polygon, "holes": [ring]}, "nothing is left"


def _of_mapping(document: Document, place: Place, value: Any) -> Iterator[Mutant]:
    if not isinstance(value, dict):
        return
    for name in value:
        here = (*place, name)
        if here != ("digest",):
            if name not in _OPTIONAL:
                missing = _signed(without(document, here))
                yield Mutant("missing key", dotted(here), "it is required", missing, dotted(here))
            wrong = (*place, f"{name}_")
            changed = _signed(renamed(document, here, wrong[-1]))
            yield Mutant("misspelt key", dotted(here), "no key has this name", changed, dotted(here))
    unknown = (*place, "colour")
    yield Mutant(
        "unknown key",
        dotted(unknown),
        "no key has this name",
        _signed(put(document, unknown, 1)),
        dotted(unknown),
    )


def _heads(document: Document) -> Iterator[Mutant]:
    for kind, name, values in (
        ("another format", "format", ("coop_drake plan 2", "", "plan", "coop_drake log")),
        ("another version", "version", (0, 1.5, 99, "2", -1)),
    ):
        for value in values:
            yield Mutant(kind, str(value), "nobody can read it", _signed(put(document, (name,), value)), name)


def digest_mutants(document: Document) -> Iterator[Mutant]:
    """Digests of something else."""
    for digest in ("", "0" * 64, document["digest"][::-1], document["digest"].upper()):
        changed = json.dumps({**document, "digest": digest}).encode()
        yield Mutant("another digest", digest[:10], "the content is another", changed, "digest")


def unsigned_mutants(document: Document, seed: int, count: int) -> Iterator[Mutant]:
    """Numbers changed by hand, in their last digits or in their sign, under the digest of others."""
    rng = random.Random(seed)
    numbers = [place for place, value in leaves(document) if type(value) is float]
    for place in rng.sample(numbers, min(count, len(numbers))):
        value = at(document, place)
        changed = json.dumps(put(document, place, value + 1e-6)).encode()
        yield Mutant("a number changed by hand", dotted(place), "the digest is another", changed)


def json_mutants(document: Document, seed: int) -> Iterator[Mutant]:
    """Broken JSON, and JSON of something else."""
    text, rng = json.dumps(document), random.Random(seed)
    for place in sorted(rng.sample(range(1, len(text)), 40)):
        yield Mutant("cut off", f"byte {place}", "the brace never closes", text[:place].encode())
    name = next(iter(document))
    for kind, content, because in (
        ("empty", "", "it says nothing"),
        ("blank", " \n", "it says nothing"),
        ("a list", "[]", "it is a mapping"),
        ("a number", "3", "it is a mapping"),
        ("nothing", "null", "it is a mapping"),
        ("an empty mapping", "{}", "keys are required"),
        ("two documents", text + text, "it is one document"),
        ("text behind", text + "and so on", "it is one document"),
        ("single quotes", text.replace('"', "'"), "JSON wants double quotes"),
        ("a comma at the end", text[:-1] + ",}", "JSON has none there"),
        ("a comment", text[:-1] + "// done\n}", "JSON has none"),
        ("a repeated key", text[:-1] + f', "{name}": 1}}', "it says two things"),
        ("YAML", "format: coop_drake plan\n", "it is no JSON"),
        ("100000 lists", "[" * 100_000 + "]" * 100_000, "nothing is so deep"),
        ("100000 mappings", '{"a":' * 100_000 + "1" + "}" * 100_000, "nothing is so deep"),
        ("a list without end", "[" * 100_000, "nothing is so deep"),
        ("a number without end", text[:-1] + ', "colour": ' + "9" * 5_000 + "}", "no key has this name"),
    ):
        yield Mutant(f"{kind} as a file", "the file", because, content.encode())


def plan_mutants(document: Document) -> Iterator[Mutant]:
    """Plans that cannot be executed, or that answer another question."""
    for k, cell in enumerate(document["cells"]):
        far = [[x + 50.0, y] for x, y in cell["tidied"]["outer"]]
        place = ("cells", k, "tidied")
        entry: Place = ("transitions", k - 1, "target") if k else ("start",)
        yield _plan(document, "cell elsewhere", (*place, "outer"), far, "it is 50 m off", entry)
        for name in ("lower", "upper"):
            other = cell["upper" if name == "lower" else "lower"]
            place = ("cells", k, name)
            yield _plan(document, "empty interval", place, other, "its ends are one", ("cells", k, "upper"))
    for k, transition in enumerate(document["transitions"]):
        here: Place = ("transitions", k)
        far = [transition["target"][0] + 50.0, transition["target"][1]]
        yield _plan(document, "target elsewhere", (*here, "target"), far, "it is 50 m off", (*here, "target"))
        for name, step in (("goal_lower", -9.0), ("goal_upper", 9.0)):
            moved = [value + step for value in transition[name]]
            yield _plan(
                document, "goal beyond the slice", (*here, name), moved, "the slice ends before", here
            )
        place = (*here, "gains", "funnel")
        yield _plan(document, "unknown funnel", place, "square", "no funnel has this shape", place)
    start, goal = document["start"], document["goal_pose"]
    for index in range(len(start)):
        moved = [value + 20.0 * (i == index) for i, value in enumerate(start)]
        yield _plan(
            document, "start elsewhere", ("start",), moved, "it is outside the first cell", ("start",)
        )
    for index in range(3):
        moved = [value + 20.0 * (i == index) for i, value in enumerate(goal)]
        yield _plan(
            document, "goal elsewhere", ("goal_pose",), moved, "the scenario has another", ("goal_pose",)
        )
    names = [f"{name}_b" for name in document["joint_names"]]
    yield _plan(document, "other joints", ("joint_names",), names, "the team has others", ("joint_names",))
    yield _plan(document, "another question", ("problem",), "0" * 64, "the floor is another", ("problem",))
    joints = [1.0, *document["goal_joints"][1:]]
    yield _plan(
        document, "another goal", ("goal_joints",), joints, "the scenario leaves it free", ("goal_joints",)
    )


def _plan(document: Document, kind: str, place: Place, value: Any, because: str, key: Place) -> Mutant:
    return Mutant(kind, dotted(place), because, _signed(put(document, place, value)), dotted(key))


def _signed(document: Document) -> bytes:
    if "digest" in document:
        document = {**document, "digest": content_digest(document)}
    return json.dumps(document).encode()


def archive_mutants(content: bytes, seed: int) -> Iterator[Mutant]:
    """Malformed copies of a sound ``.npz`` file."""
    rng = random.Random(seed)
    for place in rng.sample(range(len(content) - 22), 20):
        yield Mutant("cut off", f"byte {place}", "the directory at its end is gone", content[:place])
    yield Mutant("empty", "the file", "it is no archive", b"")
    yield Mutant("text", "the file", "it is no archive", b"times: [0, 1]\n")
    yield Mutant("an array alone", "the file", "it is no archive", _npy(np.zeros(3)))
    yield Mutant("an empty archive", "the file", "arrays are required", _npz({}), "times")
    with np.load(io.BytesIO(content)) as archive:
        arrays = {name: archive[name] for name in archive.files}
    for name, array in arrays.items():
        rest = {key: value for key, value in arrays.items() if key != name}
        yield Mutant("missing array", name, "it is required", _npz(rest), name)
        yield Mutant(
            "misspelt array", name, "no array has this name", _npz({**rest, f"{name}_": array}), name
        )
        damaged = _with_entry(content, name, b"no array")
        yield Mutant("no array", name, "these bytes are none", damaged, name)
        if array.dtype.kind in "fi":
            words = np.full(array.shape, "wide")
            yield Mutant("words for numbers", name, "they are none", _npz({**rest, name: words}), name)
            shorter = array[:-1]
            if name != "times":
                yield Mutant("a row too few", name, "every time has one", _npz({**rest, name: shorter}), name)
            flat = array.reshape(-1, 1, 1, 1)
            yield Mutant("four dimensions", name, "it has fewer", _npz({**rest, name: flat}), name)


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def _npz(arrays: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def _with_entry(content: bytes, name: str, entry: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w") as new:
        for member in old.namelist():
            new.writestr(member, entry if member == f"{name}.npy" else old.read(member))
    return stream.getvalue()
