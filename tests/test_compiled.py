"""Compiled functions: editing one compiles its callers anew, and each way of calling gives the same."""

import math
import os
import subprocess
import sys
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from coop_drake import kernel_compiler
from coop_drake.compiled import kernel_stamp

CALLEE = """
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled

CONSTANT = {constant}
TABLE = np.array([0.0, {entry}])

class {name}(NamedTuple):
    {fields[0]}: float
    {fields[1]}: float

Pair = {name}

@compiled
def slope(x):
    return {factor} * x
"""

BETWEEN = """
from callee import CONSTANT, TABLE, Pair, slope  # passed on by a file without compiled functions
"""

BY_NAME = """
from between import CONSTANT, TABLE, Pair, slope
from coop_drake.compiled import compiled

@compiled
def line(pair, x):
    return slope(x) + CONSTANT + TABLE[1] + pair.first

print(line(Pair(0.25, 0.5), 2.0), slope(2.0), line.loaded)
"""

BY_MODULE = """
import between
from coop_drake.compiled import compiled

@compiled
def line(x):
    return between.slope(x) + between.CONSTANT + between.TABLE[1]

print(line(2.0), between.slope(2.0), line.loaded)
"""

ORIGINAL = {"name": "Original", "factor": 3.0, "constant": 1.0, "entry": 10.0, "fields": ("first", "second")}


def write_callee(folder: Path, **changes: object) -> None:
    (folder / "callee.py").write_text(CALLEE.format(**{**ORIGINAL, **changes}))


def run(folder: Path, **more: str) -> list[str]:
    environment = {
        **os.environ,
        **more,
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    environment["PYTHONPATH"] = os.pathsep.join([str(folder), *sys.path])
    done = subprocess.run(
        [sys.executable, folder / "caller.py"], env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


@pytest.mark.parametrize(
    ("caller", "first", "edits"),
    [
        (
            BY_NAME,
            "17.25",
            [
                ({"factor": 5.0}, "21.25"),
                ({"constant": 2.0}, "22.25"),
                ({"entry": 20.0}, "32.25"),
                ({"fields": ("second", "first")}, "32.5"),
                ({"name": "Renamed"}, "32.5"),
            ],
        ),
        (
            BY_MODULE,
            "17.0",
            [({"factor": 5.0}, "21.0"), ({"constant": 2.0}, "22.0")],
        ),
    ],
    ids=["imported by name", "attributes of a module"],
)
def test_an_edit_in_another_file_compiles_its_users_anew(tmp_path, caller, first, edits):
    (tmp_path / "caller.py").write_text(caller)
    (tmp_path / "between.py").write_text(BETWEEN)
    values = dict(ORIGINAL)
    write_callee(tmp_path, **values)
    assert run(tmp_path) == [first, "6.0", "0"]
    assert run(tmp_path) == [first, "6.0", "1"]
    for edit, result in edits:
        values |= edit
        write_callee(tmp_path, **values)
        assert run(tmp_path) == [result, str(2.0 * values["factor"]), "0"], edit


EDITED = """
from pathlib import Path

text = Path(__file__).read_text()
Path(__file__).write_text(text.replace("3.0 *", "5.0 *"))  # somebody saves it while Python works on it

from coop_drake.compiled import compiled

@compiled
def slope(x):
    return 3.0 * x

print(slope(2.0), slope.loaded)
"""


def test_machine_code_of_a_file_that_is_edited_meanwhile_is_that_of_the_text_that_was_read(tmp_path):
    (tmp_path / "caller.py").write_text(EDITED)
    assert [run(tmp_path) for _ in range(3)] == [["6.0", "0"], ["10.0", "0"], ["10.0", "1"]]


def test_what_several_processes_keep_at_the_same_time_is_told_apart(tmp_path):
    """Files of two versions of the sources, each for two lists of types, written and read in any order."""
    versions = [kernel_compiler._Files(str(tmp_path), "kernel", stamp) for stamp in ("old", "new")]
    entries = [(files, key) for files in versions for key in ("float", "int")]
    for order in permutations(entries):
        for files, key in order:
            files.save(key, (files._source_stamp, key))
            kept = [(one.load(name), (one._source_stamp, name)) for one, name in entries]
            assert all(found in (None, own) for found, own in kept)
            assert files.load(key) == (files._source_stamp, key)


GRID = """
from typing import NamedTuple

import numpy as np

class Grid(NamedTuple):
    values: np.ndarray
    step: float
"""

KINDS = """
import pickle
import sys

import numpy as np
from grid import Grid

from coop_drake.compiled import compiled, prepared

@compiled
def total(grid, weights, factor, shift=2.0):
    return Grid(grid.values * factor + shift, grid.step), weights.sum()

@compiled(reassociate=True)
def refuse(value):
    if value < 0:
        raise ValueError("negative")
    return value

def called(values, factor, **named):
    grid, weight = total(Grid(values, 0.5), np.arange(3)[::-1], factor, **named)
    return f"{type(grid).__name__}:{grid.values.dtype}:{grid.values.sum()}:{grid.step}:{weight}"

square = np.arange(4.0).reshape(2, 2)
print(called(square, 2.0))
print(called(np.asfortranarray(square), np.float64(3.0)))
print(called(square[:, :1], True, shift=1))
weights = np.arange(3)[::-1]
scaled = prepared(total, [Grid(square, 0.5)], weights, 0.0, 0.0)
for other in (square, np.arange(3), weights.astype(float), 1.0):
    try:
        scaled(other, 2.0, 3.0)
    except TypeError as error:
        assert "total was prepared for" in str(error)
    else:
        raise AssertionError(other)
print(*(scaled(weights, 2.0, shift)[0].values.sum() for shift in (3.0, 4.0)))
assert pickle.loads(pickle.dumps(total)) is total
shown = refuse(2.5)
print(total.loaded + refuse.loaded, "numba" in sys.modules)
try:
    refuse(-1)
except ValueError as error:
    print(error, shown)
"""


def write_kinds(folder: Path, first: str = "") -> None:
    (folder / "grid.py").write_text(GRID)
    (folder / "caller.py").write_text(first + KINDS)


RESULTS = ["Grid:float64:20.0:0.5:3", "Grid:float64:26.0:0.5:3", "Grid:float64:4.0:0.5:3", "24.0", "28.0"]


def test_machine_code_is_loaded_without_numba_and_replaced_where_it_is_damaged(tmp_path):
    write_kinds(tmp_path)
    assert run(tmp_path) == [*RESULTS, "0", "True", "negative", "2.5"]
    assert run(tmp_path) == [*RESULTS, "4", "False", "negative", "2.5"]
    files = sorted(tmp_path.rglob("caller.total.*.kernel"))
    for file, damage in zip(files, (b"", b"no pickle", b"\x80\x04N."), strict=True):
        file.write_bytes(damage)
    assert run(tmp_path) == [*RESULTS, "1", "True", "negative", "2.5"]
    assert run(tmp_path) == [*RESULTS, "4", "False", "negative", "2.5"]


def test_numba_loads_its_own_copy_where_its_libraries_are_not_as_expected(tmp_path):
    unexpected = "import coop_drake.machine_code as code\ncode._LIBRARIES = ('_none',)\n"
    write_kinds(tmp_path, unexpected)
    for _ in range(2):
        assert run(tmp_path) == [*RESULTS, "0", "True", "negative", "2.5"]


def test_nothing_is_compiled_where_numba_is_told_so(tmp_path):
    lines = "from callee import slope", "from coop_drake.compiled import prepared"
    results = "print(type(slope).__name__, slope(2.0), prepared(slope, [2.0])())"
    (tmp_path / "caller.py").write_text("\n".join([*lines, results]))
    write_callee(tmp_path)
    assert run(tmp_path, NUMBA_DISABLE_JIT="1") == ["function", "6.0", "6.0"]


LIFETIMES = """
import sys
import tracemalloc
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled

class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray

@compiled
def inner(pair, row, chosen):
    wide, part, narrow, twice = pair.first, pair.first[row], pair.second, 2 * row
    part[0] += 0.5 * twice
    kept = narrow if chosen else wide[0]
    last = kept
    for k in range(2):
        last, kept = kept, pair.first[k]
    return last, kept[1:], pair, part

@compiled
def both(pair):
    parts = pair.second, pair.first
    return parts

@compiled(inlined=True)
def doubled(pair):
    return pair.first * 2.0

@compiled(whole_program={whole_program})
def outer(pair, rows, chosen):
    last, rest, same, part = inner(pair, 1, chosen)
    for k in rows:
        narrow, wide = both(same)
        begin, part, new, sign = k, wide[k], doubled(same), narrow
        if sign[0] * new[0, 0] < 0.0:
            part = new[0]
    return last, rest, part, new, same.first[rows], same, rows

def counts():
    return np.array([sys.getrefcount(first), sys.getrefcount(second), sys.getrefcount(rows)])

rows, first, second = np.array([0, 1]), np.arange(200_000.0).reshape(2, -1), np.ones(2)
pair = Pair(first, second)
tracemalloc.start()
outer(pair, rows, True)  # Its machine code is kept.
before, size = counts(), tracemalloc.get_traced_memory()[0]
for call in range(100):
    given = outer(pair, rows, call % 2 == 0)
print(*(int(part.sum()) for part in (*given[:5], given[5].first, given[6])))
print(*(counts() > before))
del given
print(*(counts() - before), tracemalloc.get_traced_memory()[0] - size < first.nbytes)
given = outer(Pair(first.copy(), second.copy()), rows.copy(), True)
others = [np.full(first.shape, np.nan) for _ in range(10)]
print(*(int(part.sum()) for part in (*given[:5], given[5].first, given[6])))
"""


@pytest.mark.parametrize("whole_program", [False, True])
def test_arrays_of_callers_live_as_long_as_results_hold_them_and_no_longer(tmp_path, whole_program):
    (tmp_path / "caller.py").write_text(LIFETIMES.format(whole_program=whole_program))
    row, moved, total = 4_999_950_000, 14_999_950_000, 19_999_900_000
    results = [
        [row, moved - 100_000, moved + n, 2 * (total + n), total + n, total + n, 1] for n in (101, 102)
    ]
    held, freed = ["True"] * 3, ["0", "0", "0", "True"]
    for _ in range(2):
        assert run(tmp_path) == [*map(str, results[0]), *held, *freed, *map(str, results[1])]


def test_another_function_of_the_same_name_changes_the_stamp():
    stamps = set()
    for module in (math, np):
        known = {"rounded": module.trunc, "m": module}
        exec("def apart(x):\n    return rounded(x) + m.floor(x)", known)
        stamps.add(kernel_stamp(known["apart"], {}))
    assert len(stamps) == 2
