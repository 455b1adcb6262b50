"""What commands import: nothing that only another command needs."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import coop_drake
from tests.support.scenarios import write_scenario

CALLED = """
import sys
from pathlib import Path
from coop_drake.cli import app
code = app(sys.argv[1:], standalone_mode=False)
print(code, *sorted({name.partition(".")[0] for name in sys.modules}))
"""
HEAVY = {"matplotlib", "meshcat", "numba", "numpy", "pydrake", "scipy", "shapely"}


def called(*arguments):
    """Exit code of a command, and which heavy packages it imported."""
    command = [sys.executable, "-c", CALLED, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    code, *modules = done.stdout.splitlines()[-1].split()
    return code, HEAVY & set(modules)


def test_help_imports_nothing_heavy():
    assert called("--help") == ("0", set())


@pytest.mark.slow
def test_planning_and_verifying_import_no_pictures(tmp_path):
    room = write_scenario(tmp_path / "room.scenario.yaml")
    for command in (("plan", room, "--out", tmp_path), ("verify", tmp_path / "plan.json", room)):
        code, modules = called(*command, "--quiet")
        assert code == "0"
        assert modules.isdisjoint({"matplotlib", "meshcat"})


def test_the_whole_package_is_imported_without_numpy():
    loaded = "import coop_drake, sys; print(*sys.modules)"
    modules = subprocess.run(
        [sys.executable, "-c", loaded], capture_output=True, text=True, check=True
    ).stdout
    assert "coop_drake.lazy" in modules.split()
    assert HEAVY.isdisjoint(modules.split())


def test_no_package_lists_a_name_that_one_of_its_modules_has():
    for stub in Path(coop_drake.__file__).parent.rglob("__init__.pyi"):
        imports = [node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)]
        names = {alias.name for node in imports for alias in node.names}
        assert names.isdisjoint(node.module for node in imports), stub
