"""What a command says while kernels are compiled, and in its closing table."""

from __future__ import annotations

import pytest
import typer

from coop_drake.cli import reporter as module
from coop_drake.cli.reporter import reporting
from coop_drake.cli.summary import summary_rows
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


SPEEDS = [
    {"name": "speed of left", "peak": 1.5, "limit": 2.0, "unit": "m/s"},
    {"name": "rate of left::elbow", "peak": 4.0, "limit": 5.0, "unit": "rad/s"},
    {"name": "rate of right::elbow", "peak": 9.0, "limit": None, "unit": "rad/s"},
]
PLANNED = {
    "answer": "found",
    "cells": 31,
    "planning_wall_seconds": 0.5,
    "estimated_seconds": 13.31,
    "budget_holds_for": "position, angles and joints",
    "tube_radius_m": 0.0021,
    "first_plan_cpu_seconds": None,
}
RUN = PLANNED | {
    "outcome": "arrived",
    "simulated_seconds": 13.42,
    "min_workspace_clearance_m": 0.1,
    "min_body_clearance_m": 0.05,
    "peak_speed_m_s": 1.74,
    "peak_base_wrench_n": 99.0,
    "final_position_error_m": 0.0056,
    "final_angle_error_rad": 0.0015,
    "peak_speeds": SPEEDS,
}


def test_a_plan_states_its_estimate_and_leaves_out_what_is_not_known():
    rows = dict(summary_rows(PLANNED))
    assert rows["answer"] == "found"
    assert rows["estimated transport"] == "13.3 s"
    assert not {"simulated transport", "nearest to a limit of motion", "error at the end"} & rows.keys()
    assert "first plan certified after" not in dict(summary_rows(PLANNED, verbose=True))


def test_a_run_has_ten_rows_and_names_the_speed_that_is_nearest_to_its_limit():
    rows = dict(summary_rows(RUN))
    assert len(rows) == 10
    assert rows["peak speed of the object"] == "1.74 m/s"
    assert rows["simulated transport"] == "13.42 s, estimated 13.3 s"
    assert rows["nearest to a limit of motion"] == "rate of left::elbow, 4.00 rad/s, limit 5"
    assert rows["error at the end"] == "0.0056 m, 0.0015 rad"


def test_more_rows_are_shown_on_demand():
    more = dict(summary_rows(RUN, verbose=True))
    assert more["peak rate of right::elbow"] == "9.00 rad/s, no limit known"
    assert more["departure of the object under its budget"] == "0.0021 m at most"
