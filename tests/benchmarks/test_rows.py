"""Rows, the file they go to, and the tables they are shown in."""

import io
import json

import pytest
from rich.console import Console

from benchmarks.rows import Ledger, LedgerError, Row
from benchmarks.table import show

BASE = Row("planner/base/cpu_seconds", 0.5, "s", "OMPL", 0.25)
GROWN = Row("planner/growth/robots/4/peak_memory", 200.0, "MB")


def test_a_row_knows_its_place_and_its_ratio():
    assert (GROWN.topic, GROWN.item, GROWN.figure) == ("planner/growth/robots", "4", "peak_memory")
    assert BASE.ratio == 2.0
    assert GROWN.ratio is None


def test_the_file_is_a_list_of_rows_that_every_run_adds_to(tmp_path):
    path = tmp_path / "bench.json"
    Ledger(path, fresh=True).add([BASE, GROWN])
    later = Ledger(path, fresh=False)
    assert later.rows == (BASE, GROWN)
    better = Row("planner/base/cpu_seconds", 0.1, "s", "OMPL", 0.25)
    later.add([better])
    entries = json.loads(path.read_text())
    assert [entry["name"] for entry in entries] == [BASE.name, GROWN.name]
    assert entries[0] == {
        "name": "planner/base/cpu_seconds",
        "value": 0.1,
        "unit": "s",
        "peer": "OMPL",
        "peer_value": 0.25,
        "ratio": 0.4,
    }
    assert Ledger(path, fresh=True).rows == ()


@pytest.mark.parametrize("content", ["{", "{}", '[{"name": "a"}]', "[1]"])
def test_a_file_of_something_else_is_refused_and_left_alone(tmp_path, content):
    path = tmp_path / "bench.json"
    path.write_text(content)
    with pytest.raises(LedgerError, match=r"bench\.json"):
        Ledger(path, fresh=False)
    assert path.read_text() == content


def test_tables_show_topics_with_items_and_figures():
    console = Console(width=120, record=True, file=io.StringIO())
    answer = Row("planner/base/answer", 1.0, "found")
    show([BASE, GROWN, answer], console)
    shown = console.export_text()
    for text in ("planner/growth/robots", "base", "0.5 (x2)", "found", "200", "beside OMPL, 0.25 s"):
        assert text in shown
