"""Compiled functions: an edit compiles callers anew; damage, and processes at the same time, do no harm."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import coop_drake
from coop_drake.jit import compiled

PACKAGE = Path(coop_drake.__file__).parent

CALLEE = """
from typing import NamedTuple

from coop_drake.jit import compiled
from pack.constants import OFFSET


class Pair(NamedTuple):
    first: float
    second: float


@compiled
def slope(x):
    return 3.0 * x + OFFSET
"""

CALLER = """
from coop_drake.jit import compiled
from pack.callee import Pair, slope


@compiled
def line(pair, x, times):
    return times * slope(x) + pair.first


def hits(function):
    return sum(function.stats.cache_hits.values())
"""


@pytest.fixture
def folder(tmp_path):
    """A package beside copies of the files that compile, and room for machine code."""
    for name in ("jit.py", "compiling.py", "files.py"):
        (tmp_path / "coop_drake").mkdir(exist_ok=True)
        shutil.copy(PACKAGE / name, tmp_path / "coop_drake")
    (tmp_path / "coop_drake" / "__init__.py").touch()
    (tmp_path / "pack").mkdir()
    (tmp_path / "pack" / "constants.py").write_text("OFFSET = 0.5\n")
    (tmp_path / "pack" / "callee.py").write_text(CALLEE)
    (tmp_path / "pack" / "caller.py").write_text(CALLER)
    return tmp_path


def start(folder: Path, *numbers: str, **more: str) -> subprocess.Popen[str]:
    code = f"import pack.caller as c\nfor x in ({', '.join(numbers)},):\n    "
    code += "print(c.line(c.Pair(0.25, 0.5), x, 1), c.hits(c.line))"
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1", **more}
    environment.pop("NUMBA_CACHE_DIR", None)
    return subprocess.Popen(
        [sys.executable, "-c", code], cwd=folder, env=environment | more, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


def run(folder: Path, *numbers: str, **more: str) -> list[str]:
    process = start(folder, *(numbers or ("2.0",)), **more)
    out, err = process.communicate()
    assert process.returncode == 0, err
    return out.split()


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def test_an_edit_of_a_callee_of_its_constants_or_named_tuples_compiles_the_caller_anew(folder):
    callee, constants = folder / "pack" / "callee.py", folder / "pack" / "constants.py"
    assert run(folder) == ["6.75", "0"]
    assert run(folder, NUMBA_NUM_THREADS="1") == ["6.75", "1"]
    edit(callee, "3.0 * x", "5.0 * x")
    assert run(folder) == ["10.75", "0"]
    edit(constants, "0.5", "1.5")
    assert run(folder) == ["11.75", "0"]
    edit(callee, "first: float\n    second: float", "second: float\n    first: float")
    assert run(folder) == ["12.0", "0"]
    edit(constants, "1.5", "0.5")
    edit(folder / "coop_drake" / "files.py", '"""Writes', '"""It writes')  # The compiling files import it.
    assert run(folder) == ["11.0", "0"]
    assert run(folder) == ["11.0", "1"]
    versions = list((folder / "coop_drake" / "__pycache__" / "kernels" / "pack.caller").iterdir())
    assert len(versions) == 3, "old machine code is removed"


@pytest.mark.slow
def test_machine_code_goes_where_the_user_says_or_to_the_user_s_cache_or_is_not_kept(folder):
    assert run(folder, NUMBA_CACHE_DIR=str(folder / "named")) == ["6.75", "0"]
    assert run(folder, NUMBA_CACHE_DIR=str(folder / "named")) == ["6.75", "1"]
    (folder / "coop_drake" / "__pycache__").write_text("no folder can be made here, whoever asks")
    cache = str(folder / "cache")
    assert [run(folder, COOP_DRAKE_CACHE=cache)[1] for _ in range(2)] == ["0", "1"]
    assert [run(folder, COOP_DRAKE_CACHE=str(folder / "pack" / "callee.py"))[1] for _ in range(2)] == [
        "0"
    ] * 2


@pytest.mark.slow
def test_damaged_machine_code_is_replaced(folder):
    run(folder)
    for kind, damage in (("nbi", b"no pickle"), ("nbc", b"")):
        (damaged,) = (folder / "coop_drake" / "__pycache__").rglob(f"caller.line-*.{kind}")
        damaged.write_bytes(damage)
        assert run(folder) == ["6.75", "0"], kind
    assert run(folder) == ["6.75", "1"]


@pytest.mark.slow
def test_machine_code_for_other_types_under_the_name_of_a_file_is_not_called(folder):
    """As where two processes write at the same time: the index of one, the machine code of the other."""
    run(folder, "2.0")
    (file,) = (folder / "coop_drake" / "__pycache__").rglob("caller.line-*.nbc")
    for_float = file.read_bytes()
    shutil.rmtree(folder / "coop_drake" / "__pycache__")
    run(folder, "2")
    (file,) = (folder / "coop_drake" / "__pycache__").rglob("caller.line-*.nbc")
    file.write_bytes(for_float)
    assert run(folder, "2") == ["6.75", "1"]  # The wrong one was loaded, and compiled again.
    assert run(folder, "2") == ["6.75", "1"]
    assert run(folder, "2.0") == ["6.75", "0"]


@pytest.mark.slow
def test_processes_that_compile_at_the_same_time_do_no_harm(folder):
    kinds = ("2.0", "2"), ("2", "2.0"), ("True", "2.0")
    processes = [start(folder, *numbers) for numbers in kinds]
    outputs = [process.communicate() for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0], outputs
    assert [run(folder, *numbers)[::2] for numbers in kinds] == [out.split()[::2] for out, _ in outputs]


def test_a_first_call_says_how_far_compiling_is(folder):
    process = start(folder, "2.0")
    assert "first call: 1 of at most 2; later" in process.communicate()[1]
    process = start(folder, "2.0")
    assert process.communicate()[1] == ""


def test_nothing_is_compiled_where_numba_is_told_so(folder):
    code = "from pack.callee import slope; print(type(slope).__name__, slope(2.0))"
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True)
    assert done.stdout.split() == [b"function", b"6.5"]


def test_a_function_that_borrows_arrays_may_not_return_one():
    @compiled(borrows=True)
    def same(values):
        return values

    with pytest.raises(TypeError, match="same returns an array"):
        same(np.ones(2))


def test_functions_that_borrow_arrays_call_none_that_returns_one():
    """Numba would not count the reference that it gets, and never free the array."""
    returning, calls = set(), []
    for file in PACKAGE.rglob("*.py"):
        module = ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts)
        body = ast.parse(file.read_text()).body
        known = {each.name: module for each in body if isinstance(each, ast.FunctionDef)}
        for node in body:
            if isinstance(node, ast.ImportFrom):
                known |= {each.name: str(node.module) for each in node.names}
        for node in body:
            decorators = [ast.unparse(each) for each in getattr(node, "decorator_list", ())]
            if isinstance(node, ast.FunctionDef) and any(each.startswith("compiled") for each in decorators):
                words = set(re.findall(r"\w+", ast.unparse(node.returns)))
                if words - {"None", "float", "int", "bool", "tuple", "Value", "Sums"}:
                    returning.add((module, node.name))
                if any("borrows=True" in each for each in decorators):
                    called = [each.func for each in ast.walk(node) if isinstance(each, ast.Call)]
                    names = {each.id for each in called if isinstance(each, ast.Name)}
                    calls.append((node.name, {(known.get(name), name) for name in names}))
    assert len(calls) > 100
    assert not [(name, callees & returning) for name, callees in calls if callees & returning]
