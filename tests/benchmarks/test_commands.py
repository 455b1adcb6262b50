"""Commands as they are typed: what they say becomes rows, and a failure says which command failed."""

import json

import pytest

from benchmarks import commands
from benchmarks.isolated import WorkerError


def test_help_is_measured_beside_a_bare_python():
    (row,) = commands.bench_help()
    assert row.name == "command/help/wall_seconds"
    assert row.value > 0.0
    assert row.peer_value > 0.0


def test_a_plan_is_measured_by_what_it_says(monkeypatch):
    monkeypatch.setattr(commands, "_called", lambda arguments: json.dumps({"peak_memory_mb": 123.0}))
    rows = {row.name: (row.value, row.unit) for row in commands.bench_commands("base")}
    assert set(rows) == {
        f"command/plan_base/{what}" for what in ("wall_seconds", "cpu_seconds", "peak_memory")
    }
    assert rows["command/plan_base/peak_memory"] == (123.0, "MB")


def test_a_command_that_fails_is_named():
    with pytest.raises(WorkerError, match=r"coop-drake plan .*nowhere\.scenario\.yaml(.|\n)* failed"):
        commands.bench_commands("nowhere")
