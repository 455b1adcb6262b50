"""What a command says while functions are compiled for the first time."""

from __future__ import annotations

import pytest
import typer

from coop_drake.cli import reporter as module
from coop_drake.cli.reporter import reporting
from coop_drake.compiling import COMPILING


@pytest.fixture
def clock(monkeypatch):
    """The time that the reporter reads [s]."""
    now = [0.0]
    monkeypatch.setattr(module, "perf_counter", lambda: now[0])
    monkeypatch.setattr(COMPILING, "functions", 40)
    monkeypatch.setattr(COMPILING, "names", set())
    return now


def _compile_one_each_second(clock, **options):
    with reporting(**options) as reporter, reporter.stage("planning"):
        for second in range(25):
            clock[0] = float(second)
            COMPILING.announce(f"function_{second}")
            COMPILING.announce("function_0")  # For other types: not counted twice.


def test_without_a_terminal_lines_at_a_low_rate_say_how_many_functions_are_compiled(clock, capsys):
    with pytest.raises(typer.Exit):
        _compile_one_each_second(clock)
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        f"Compiled {count} of at most 40 functions; later runs load them from the cache"
        for count in (1, 11, 21)
    ]


def test_machines_get_the_lines_on_standard_error_and_the_quiet_none(clock, capsys):
    with pytest.raises(typer.Exit):
        _compile_one_each_second(clock, machine=True)
    out, err = capsys.readouterr()
    assert "Compiled" not in out
    assert err.count("Compiled") == 3
    with pytest.raises(typer.Exit):
        _compile_one_each_second(clock, quiet=True)
    assert capsys.readouterr() == ("", "")
