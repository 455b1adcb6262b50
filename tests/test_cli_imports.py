"""What commands bring in: nothing that only another command needs."""

from __future__ import annotations

import subprocess
import sys

import pydrake  # noqa: F401  Some tests take it away.
import pytest

from coop_drake.cli import question
from coop_drake.cli.question import read_apart
from tests.support.scenarios import write_scenario

CALLED = """
import sys
from coop_drake.cli import app
code = app(sys.argv[1:], standalone_mode=False)
print(code, *sorted({name.partition(".")[0] for name in sys.modules}))
"""
BROKEN = """
import coop_drake.scenario
def broken(path):
    raise ZeroDivisionError("here")
coop_drake.scenario.load_scenario = broken
"""
HEAVY = {"matplotlib", "meshcat", "numba", "numpy", "pydrake", "scipy", "shapely"}


def called(*arguments):
    """Exit code of a command, and which heavy packages it brought in."""
    command = [sys.executable, "-c", CALLED, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    code, *modules = done.stdout.splitlines()[-1].split()
    return code, HEAVY & set(modules)


def test_help_brings_in_nothing_heavy():
    assert called("--help") == ("0", set())


def test_planning_and_verifying_keep_drake_and_pictures_out_of_their_memory(tmp_path):
    room = write_scenario(tmp_path / "room.scenario.yaml")
    assert called("plan", room, "--out", tmp_path, "--quiet") == ("0", {"numba", "numpy", "scipy", "shapely"})
    code, modules = called("verify", tmp_path / "plan.json", room, "--quiet")
    assert code == "0"
    assert modules.isdisjoint({"matplotlib", "meshcat", "pydrake"})


def test_a_process_that_reads_and_dies_is_no_answer(tmp_path, monkeypatch):
    dies = tmp_path / "dies"
    dies.write_text("#!/bin/sh\ncat > /dev/null\nexit 7\n")
    dies.chmod(0o755)
    monkeypatch.delitem(sys.modules, "pydrake")
    monkeypatch.setattr(question.sys, "executable", str(dies))
    with pytest.raises(RuntimeError, match=r"ended with code 7"):
        read_apart(tmp_path / "room.scenario.yaml")


def test_a_bug_in_reading_comes_with_its_traceback(tmp_path, monkeypatch):
    (tmp_path / "sitecustomize.py").write_text(BROKEN)
    monkeypatch.delitem(sys.modules, "pydrake")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ZeroDivisionError, match="here") as caught:
        read_apart(tmp_path / "room.scenario.yaml")
    assert "in broken" in caught.value.__notes__[0]
