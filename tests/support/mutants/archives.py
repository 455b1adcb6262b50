"""Simulation logs that are malformed: archives cut or overwritten, arrays missing, misshapen or of text."""

from __future__ import annotations

import io
import random
import zipfile
from collections.abc import Iterator

import numpy as np

from tests.support.mutants.mutant import Mutant


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
