"""The bisection of critical widths, with answers by hand."""

from math import isfinite
from types import SimpleNamespace

import pytest

from benchmarks.planner import critical_width
from benchmarks.planner.critical_width import CORRIDORS, Corridor, critical_interval, critical_width_rows


def asked(answer):
    """An interval of a planner that answers by the width itself, two seconds each."""
    return critical_interval(
        Corridor(lambda width: width, 0.7, 0.8, 1e-3), lambda width: (answer(width), 2.0)
    )


def test_bounds_meet_at_the_critical_width():
    found = asked(
        lambda width: "infeasible" if width < 0.7314 else "beyond limits" if width < 0.75 else "found"
    )
    assert found.no_way < 0.7314 <= found.way
    assert found.way - found.no_way <= 1e-3
    assert found.undecided == ()
    assert set(found.seconds) == {2.0}


def test_undecided_widths_keep_the_bounds_apart():
    found = asked(lambda width: "infeasible" if width < 0.72 else "found" if width > 0.74 else "undecided")
    assert 0.719 <= found.no_way < 0.72
    assert 0.74 < found.way <= 0.741
    assert all(0.72 <= width <= 0.74 for width in found.undecided)
    assert len(found.seconds) < 20


def test_a_bound_that_takes_too_long_is_unknown(monkeypatch):
    ended = SimpleNamespace(value=None)
    monkeypatch.setattr(critical_width, "in_own_process", lambda *given, limit: ended)
    rows = critical_width_rows("two", Corridor(lambda width: width, 0.7, 0.8, 1e-3), 60.0)
    assert all(isfinite(row.value) for row in rows)
    assert (rows[0].name, rows[0].value, rows[0].unit) == ("two/answer", 0.0, "unknown to unknown")
    assert rows[1].unit == "of 2 widths"


@pytest.mark.parametrize("name", CORRIDORS)
def test_corridors_are_questions_of_their_width(name):
    corridor = CORRIDORS[name]
    narrow, wide = corridor.ask(corridor.narrow).workspace, corridor.ask(corridor.wide).workspace
    assert narrow.area < wide.area
