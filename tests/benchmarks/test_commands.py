"""Commands as they are typed: what they say becomes rows, and a failure says which command failed."""

import json

import pytest

from benchmarks import commands
from benchmarks.isolated import WorkerError


def test_starts_are_ratios_to_the_import_of_drake(monkeypatch):
    monkeypatch.setattr(commands, "called", lambda arguments: json.dumps({"peak_memory_mb": 350.0}))
    monkeypatch.setattr(commands, "run_program", lambda command: "")
    (task,) = commands.starting_tasks()
    rows = {row.name.removeprefix("starting/commands/"): row for row in task.measure(())}
    assert {name.partition("/")[0] for name in rows} == {
        "import_coop_drake",
        "help",
        "plan_base",
        "verify_base",
        "run_base",
    }
    assert "pydrake.all" in rows["run_base/wall_seconds"].peer
    assert rows["plan_base/peak_memory"].ratio == 350.0 / 500.0


def test_a_plan_is_measured_by_what_it_says(monkeypatch):
    monkeypatch.setattr(commands, "called", lambda arguments: json.dumps({"peak_memory_mb": 123.0}))
    rows = {row.name: (row.value, row.unit) for row in commands.bench_commands("base")}
    assert set(rows) == {
        f"command/plan_base/{what}" for what in ("wall_seconds", "cpu_seconds", "peak_memory")
    }
    assert rows["command/plan_base/peak_memory"] == (123.0, "MB")


def test_a_command_that_fails_is_named():
    with pytest.raises(WorkerError, match=r"plan .*nowhere\.scenario\.yaml(.|\n)* failed"):
        commands.bench_commands("nowhere")
