"""Functions that are compiled after a whole program call the originals, not the program's own copies."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

FUNCTIONS = """
from typing import NamedTuple

import numpy as np

from coop_drake.compiled import compiled

class Chain(NamedTuple):
    lengths: np.ndarray
    angles: np.ndarray
    unused: np.ndarray

@compiled
def reach(chain, scale, unused):
    # Too long to be put in the place of its calls.
    total = 0.0
    for k in range(chain.lengths.shape[0]):
        total += scale * chain.lengths[k] * np.cos(chain.angles[k])
        rest = np.sin(chain.angles[k]) * np.exp(chain.angles[k]) * np.tanh(chain.angles[k])
        for j in range(chain.lengths.shape[0]):
            rest *= np.arctan2(chain.lengths[j], chain.lengths[k]) * np.hypot(chain.lengths[j], scale)
            if rest > chain.lengths[j]:
                rest = np.sinh(rest) - np.log(rest + 1.0) * np.cosh(rest)
        if np.abs(rest) > 1e-3:
            total += rest * np.sqrt(np.abs(chain.angles[k]))
    return total

@compiled
def turned(chain, unused):
    angles = chain.angles + reach(chain, 0.0, unused)
    return Chain(chain.lengths, angles + np.pi, chain.unused)

@compiled(whole_program=True)
def program(chain):
    total = 0.0
    for k in range(3):
        total += reach(chain, 1.0, k) + reach(turned(chain, k), 1.0, k) + reach(chain, 2.0, k)
        total += reach(turned(chain, 1), 3.0, 1) + reach(turned(chain, 1), k, 1) + reach(chain, k, k)
    return total

@compiled
def later(chain):
    return reach(chain, 2.0, 1) + reach(turned(chain, 2), 4.0, 2)

chain = Chain(np.arange(1.0, 8.0), np.zeros(7), np.zeros(3))
print(program(chain), later(chain), program.loaded, later.loaded)
"""


def results(folder: Path) -> list[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(Path.cwd()), str(folder)])}
    environment["NUMBA_CACHE_DIR"] = str(folder / "kept")
    ran = subprocess.run(
        [sys.executable, "functions.py"], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert ran.returncode == 0, (ran.returncode, ran.stderr)
    return ran.stdout.split()


def remove(folder: Path, pattern: str) -> None:
    found = list((folder / "kept").rglob(pattern))
    assert found, pattern
    for file in found:
        file.unlink()


@pytest.mark.parametrize("state", ["compiled", "kept", "kept by numba alone"])
def test_what_is_compiled_later_calls_the_originals(tmp_path, state):
    (tmp_path / "functions.py").write_text(FUNCTIONS)
    loaded = "0"
    if state != "compiled":
        results(tmp_path)
        remove(tmp_path, "*later*.kernel")
        remove(tmp_path, "*later*.nbc")
        loaded = "1"
    if state == "kept by numba alone":
        remove(tmp_path, "*program*.kernel")
        loaded = "0"
    assert results(tmp_path) == ["-84.0", "-56.0", loaded, "0"]
