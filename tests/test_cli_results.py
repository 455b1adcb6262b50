"""Folders of results and of maps: what others wrote stays, what a run wrote before goes, maps are kept."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from coop_drake.cli import app
from coop_drake.cli import results as results_module
from coop_drake.cli.reporter import Reporter
from coop_drake.cli.results import ResultFolder
from coop_drake.cli.task import map_cache, map_cells, read_task, write_accuracies
from coop_drake.errors import FieldError, ScenarioError
from tests.support.scenarios import write_scenario
from tests.support.small_plan import small_plan, with_motion

COMMANDS = {
    "plan": ("plan.json", "certificate.json", "table_1.md"),
    "run": (
        "plan.json",
        "log.npz",
        "summary.png",
        "fig05_path.png",
        "fig10_joints_left.png",
        "transport.html",
    ),
    "simulate": ("log.npz", "maps.json", "fig11_joints_right.png"),
    "tune": ("plan.json", "gains.yaml", "trials.json"),
    "why": ("why.png", "why.svg"),
    "watch": ("think.html", "think_0001.png"),
    "diagram": ("diagram.svg",),
}


@pytest.mark.parametrize(("command", "name"), [(c, name) for c, names in COMMANDS.items() for name in names])
def test_a_file_of_somebody_else_is_refused_before_any_work(command, name, tmp_path):
    scenario = write_scenario(tmp_path / "room.scenario.yaml")
    mine = tmp_path / "project" / name
    mine.parent.mkdir()
    mine.write_text("mine")
    result = CliRunner().invoke(app, [command, str(scenario), "--out", str(mine.parent)])
    assert result.exit_code == 2
    said = result.output.replace("\n", "")
    assert f"{mine}: --out" in said
    assert "another program wrote it" in said
    assert [path.name for path in mine.parent.iterdir()] == [name]
    assert mine.read_text() == "mine"


def test_files_of_others_stay_where_results_come_and_go(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "fig99_mine.png").write_text("mine")
    folder = ResultFolder(tmp_path)
    folder.begin("plan", "simulation", robots=("left", "right"))
    for name in ("plan.json", "log.npz", "fig10_joints_left.png", "fig11_joints_right.png"):
        (tmp_path / name).write_text("ours")
    ResultFolder.of("room", tmp_path, "plan", "simulation").begin("simulation", robots=("a", "b"))
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        ".coop_drake_results.json",
        "fig99_mine.png",
        "notes.txt",
        "plan.json",
    ]


def test_a_list_that_was_altered_removes_nothing_outside_the_folder(tmp_path):
    outside = tmp_path / "outside.txt"
    outside.write_text("mine")
    folder = ResultFolder(tmp_path / "out")
    folder.begin("plan")
    (folder.path / ".coop_drake_results.json").write_text(json.dumps({"plan": ["../outside.txt"]}))
    folder.begin("plan")
    assert outside.exists()
    for nonsense in ("[]", "{", '{"plan": 3}', '{"plan": [3]}'):
        (folder.path / ".coop_drake_results.json").write_text(nonsense)
        (folder.path / "plan.json").write_text("whose?")
        with pytest.raises(ScenarioError):
            ResultFolder.of("room", folder.path, "plan")


def test_a_folder_that_cannot_be_written_is_noticed_before_planning(tmp_path, monkeypatch):
    def refused(dir):
        raise PermissionError(13, "Permission denied", str(dir))

    monkeypatch.setattr(results_module.tempfile, "TemporaryFile", refused)
    scenario = write_scenario(tmp_path / "room.scenario.yaml")
    result = CliRunner().invoke(app, ["run", str(scenario), "--out", str(tmp_path / "new" / "deeper")])
    assert result.exit_code == 2
    assert f"{tmp_path}: permission denied" in result.output.replace("\n", "")
    assert not (tmp_path / "new").exists()


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path):
    folder = ResultFolder(tmp_path)
    folder.begin("plan")
    (tmp_path / ".plan.json.a1b2c3.part").write_text("half")
    folder.begin("plan")
    assert [path.name for path in tmp_path.iterdir()] == [".coop_drake_results.json"]


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
    assert all(row["condition"] > 1.0 and row["unknowns"] > 0 and row["worst_place"] for row in rows)
    assert reporter.facts["max_map_residual"] == max(row["residual"] for row in rows)
    assert reporter.facts["max_map_unknowns"] == max(row["unknowns"] for row in rows)
    assert reporter.facts["mapping_wall_seconds"] > 0.0


def test_a_plan_with_a_motion_is_mapped_nowhere(tmp_path):
    reporter, task = Reporter(machine=True, quiet=True), task_with(tmp_path, 1e-9)
    maps = map_cells(task, with_motion(PLAN), reporter)
    write_accuracies(task, maps, ResultFolder(tmp_path))
    assert maps == ()
    assert "maps" not in reporter.facts
    assert not (tmp_path / "maps.json").exists()
    assert not (tmp_path / "cache").exists()


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
    message = r"cell 0 of 3: .*the error is largest at .*room\.scenario\.yaml: maps\.tolerance is 1e-15"
    with pytest.raises(FieldError, match=message):
        map_cells(task_with(tmp_path, 1e-15), PLAN, Reporter(machine=True, quiet=True), fresh=True)
