"""Compiled functions: editing one compiles its callers anew, and each way of calling gives the same."""

import os
import subprocess
import sys
from pathlib import Path

CALLEE = """
from coop_drake.compiled import compiled

@compiled
def slope(x):
    return {factor} * x
"""

CALLER = """
from callee import slope
from coop_drake.compiled import compiled

@compiled
def line(x):
    return slope(x) + 1.0

print(line(2.0), slope(2.0), sum(line.stats.cache_hits.values()))
"""


def run(folder: Path) -> list[str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    environment["PYTHONPATH"] = os.pathsep.join([str(folder), *sys.path])
    done = subprocess.run(
        [sys.executable, folder / "caller.py"], env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_an_edited_callee_compiles_its_callers_anew(tmp_path):
    (tmp_path / "caller.py").write_text(CALLER)
    (tmp_path / "callee.py").write_text(CALLEE.format(factor=3.0))
    assert run(tmp_path) == ["7.0", "6.0", "0"]
    assert run(tmp_path) == ["7.0", "6.0", "1"]
    (tmp_path / "callee.py").write_text(CALLEE.format(factor=5.0))
    assert run(tmp_path) == ["11.0", "10.0", "0"]


PAIR = """
from typing import NamedTuple
from coop_drake.compiled import compiled

class {name}(NamedTuple):
    x: float

@compiled
def first(pair):
    return pair.x

print(first({name}(4.0)), sum(first.stats.cache_hits.values()))
"""


def test_a_class_that_an_older_version_had_is_no_error(tmp_path):
    (tmp_path / "caller.py").write_text("import pairs")
    for name in ("Pair", "Couple"):
        (tmp_path / "pairs.py").write_text(PAIR.format(name=name))
        assert run(tmp_path) == ["4.0", "0"]
    assert run(tmp_path) == ["4.0", "1"]
