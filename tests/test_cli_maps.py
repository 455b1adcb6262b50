"""The maps of a run: estimated in a file, kept for later runs, forgotten on demand."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.task import map_cache, map_cells, read_task, write_accuracies
from coop_drake.errors import FieldError
from tests.support.scenarios import write_scenario
from tests.support.small_plan import small_plan

PLAN = small_plan(())


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """A cache for every test."""
    monkeypatch.setenv("COOP_DRAKE_CACHE", str(tmp_path / "cache"))


def task_with(tmp_path, tolerance):
    return read_task(write_scenario(tmp_path / "room.scenario.yaml", maps={"tolerance": tolerance}), None)


def shown(*arguments):
    result = CliRunner().invoke(app, ["doctor", "--json", *arguments])
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def test_accuracies_of_all_cells_are_written_and_summed_up(tmp_path):
    task, reporter, folder = (
        task_with(tmp_path, 1e-9),
        Reporter(machine=True, quiet=True),
        ResultFolder(tmp_path),
    )
    maps = map_cells(task, PLAN, reporter, fresh=True)
    write_accuracies(task, maps, folder)
    document = json.loads((folder.path / "maps.json").read_text())
    assert document["tolerance"] == 1e-9
    rows = document["maps"]
    assert [row["cell"] for row in rows] == list(range(len(PLAN.cells)))
    assert all(0.0 < row["residual"] <= row["error_estimate"] <= 1e-9 for row in rows)
    assert all(
        row["condition"] > 1.0 and row["unknowns"] > 0 and row["worst_place_description"] for row in rows
    )
    assert reporter.facts["max_map_residual"] == max(row["residual"] for row in rows)
    assert reporter.facts["max_map_unknowns"] == max(row["unknowns"] for row in rows)
    assert reporter.facts["mapping_wall_seconds"] > 0.0


def test_maps_are_kept_unless_fresh_ones_are_asked_for(tmp_path):
    task, reporter = task_with(tmp_path, 1e-7), Reporter(machine=True, quiet=True)
    read = []
    for fresh in (True, False, False, True):
        map_cells(task, PLAN, reporter, fresh=fresh)
        read.append(reporter.facts["maps_read"])
    assert read == [0, 0, len(PLAN.cells), 0]


def test_the_cache_is_shown_and_cleared(tmp_path):
    assert shown("--maps")["maps"] == 0
    map_cells(task_with(tmp_path, 1e-7), PLAN, Reporter(machine=True, quiet=True), fresh=False)
    facts = shown("--clear-maps")
    assert facts["maps"] == len(PLAN.cells)
    assert facts["size_mb"] > 0.0
    assert facts["folder"].startswith(str(tmp_path / "cache"))
    assert shown("--maps")["maps"] == 0


def test_the_cache_lies_where_the_system_keeps_caches_unless_named(monkeypatch):
    monkeypatch.delenv("COOP_DRAKE_CACHE")
    assert "coop_drake" in map_cache().folder.parts


def test_a_tolerance_that_cannot_be_met_fails_with_cell_place_and_key(tmp_path):
    message = r"cell 0 of 3: .*at fault is the .*room\.scenario\.yaml: maps\.tolerance is 1e-15"
    with pytest.raises(FieldError, match=message):
        map_cells(task_with(tmp_path, 1e-15), PLAN, Reporter(machine=True, quiet=True), fresh=True)
