"""The command line: answers, exit codes, files, JSON, and no traceback for a user's mistake."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import nullcontext, redirect_stdout
from dataclasses import replace
from io import StringIO
from math import inf, nan
from typing import ClassVar

import numpy as np
import pytest
import typer

from coop_drake import simulation
from coop_drake.answers import load_plan
from coop_drake.answers.log import SimulationLog
from coop_drake.cli import run, simulate
from coop_drake.cli.reporter import Reporter, reporting
from coop_drake.cli.task import read_task
from coop_drake.errors import PlanError
from coop_drake.viz import LivePage
from tests.support.cli import invoke
from tests.support.scenarios import MODELS, ROOM, write_scenario
from tests.support.short_search import sample_little


class NoDrawings(nullcontext):
    """Stands in for ``DrawingProcesses``.

    Attributes:
        asked: Log and folder of every run that was to be drawn since this list was last emptied.
        order: What was waited for in the last run; "none" first if it was to have no figures.
    """

    asked: ClassVar[list[tuple]] = []
    order: ClassVar[list[str]] = []

    def __init__(self, *, figures=True):
        super().__init__()
        self.order[:] = [] if figures else ["none"]

    def __enter__(self):
        return self

    def begin(self, *question):
        pass

    def draw(self, *asked):
        self.asked.append(asked)

    def wait(self, *subjects):
        self.order.extend(subjects)


PLAN_KEYS = {
    "answer",
    "cells",
    "slices",
    "first_plan_cpu_seconds",
    "planning_cpu_seconds",
    "peak_memory_mb",
}
RUN_KEYS = PLAN_KEYS | {
    "reached",
    "violations",
    "final_position_error_m",
    "final_angle_error_rad",
    "min_clearance_m",
    "min_delta_e",
    "max_acceleration_error",
    "max_wrench_error_n",
    "max_governor_spread_m",
    "messages",
    "simulated_seconds",
    "simulation_wall_seconds",
}
MAP_KEYS = {"max_map_residual", "mapping_wall_seconds"}
RESULTS = [
    ".coop_drake_results.json",
    "log.npz",
    "plan.json",
    "summary.png",
    "table_1.md",
    "transport.html",
]


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return write_scenario(tmp_path_factory.mktemp("scenario") / "room.scenario.yaml")


@pytest.fixture(scope="module")
def finished(room, tmp_path_factory):
    out = tmp_path_factory.mktemp("finished")
    return out, invoke("run", room, "--out", out, "--json")


@pytest.fixture(scope="module")
def rested(room, tmp_path_factory):
    """A run of the team that rests in every cell."""
    out = tmp_path_factory.mktemp("rested")
    return out, invoke("run", room, "--gains", "scheduled", "--out", out, "--json")


def test_a_run_answers_with_one_json_object_and_exit_code_0(finished):
    _, result = finished
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    assert facts.keys() >= RUN_KEYS
    assert facts["answer"] == "found"
    assert facts["reached"] is True
    assert facts["violations"] == 0
    assert facts["final_position_error_m"] <= 0.01
    assert facts["min_clearance_m"] > 0.0
    assert facts["estimated_seconds"] == pytest.approx(facts["simulated_seconds"], rel=0.02)
    assert len(result.stdout.splitlines()) == 1


def test_a_run_leaves_plan_log_table_recording_and_figures(finished):
    out, result = finished
    names = sorted(path.name for path in out.iterdir())
    assert [name for name in names if not name.startswith("fig")] == RESULTS
    assert {name[:5] for name in names if name.startswith("fig")} == {f"fig{k:02d}" for k in range(4, 14)}
    facts, log = json.loads(result.stdout), SimulationLog.load(out / "log.npz")
    assert facts["cells"] == len(load_plan(out / "plan.json").cells)
    assert facts["simulated_seconds"] == pytest.approx(log.times[-1])
    assert facts["min_clearance_m"] == min(log.workspace_clearance.min(), log.body_clearance.min())


def test_a_run_of_a_team_that_rests_leaves_the_accuracies_of_its_maps_too(rested):
    out, result = rested
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout).keys() >= RUN_KEYS | MAP_KEYS
    names = sorted(path.name for path in out.iterdir() if not path.name.startswith("fig"))
    assert names == sorted([*RESULTS, "maps.json"])


def test_the_log_of_a_run_is_verified_and_an_altered_one_refused(finished, room, tmp_path):
    out, _ = finished
    result = invoke("verify", out / "log.npz", room, "--json")
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    assert (facts["valid"], facts["answer"]) == (True, "arrived")
    log = SimulationLog.load(out / "log.npz")
    log.joints[20, 1] += 1e-3
    log.save(tmp_path / "log.npz")
    refused = invoke("verify", tmp_path / "log.npz", room, "--plan", out / "plan.json", "--json")
    assert refused.exit_code == 1
    assert json.loads(refused.stdout)["where"].startswith("object_pose, joints[20, ")
    alone = invoke("verify", tmp_path / "log.npz", room, "--quiet")
    assert alone.exit_code == 2
    assert "expected the plan of the log, or --plan FILE" in " ".join(alone.output.split())


def test_people_see_bars_and_a_table_and_quiet_shows_nothing(room, tmp_path):
    shown = invoke("plan", room, "--out", tmp_path)
    assert shown.exit_code == 0
    assert "planning" in shown.stdout
    assert "cells" in shown.stdout
    assert "smallest path clearance in a cell" not in shown.stdout
    more = invoke("plan", room, "--out", tmp_path, "--verbose")
    assert "smallest path clearance in a cell" in more.stdout
    assert invoke("plan", room, "--out", tmp_path, "--quiet").output == ""


@pytest.fixture
def drawn(monkeypatch):
    """Runs that were to be drawn; drawing itself is slow, and looked at after the first run."""
    NoDrawings.asked.clear()
    for module in (run, simulate):
        monkeypatch.setattr(module, "DrawingProcesses", NoDrawings)
    return NoDrawings.asked


def test_a_plan_made_before_is_carried_out_with_other_gains(rested, room, tmp_path, drawn):
    out, _ = rested
    result = invoke(
        "simulate", room, "--plan", out / "plan.json", "--out", tmp_path, "--gains", "table_2", "--json"
    )
    assert result.exit_code == 0, result.stderr
    facts = json.loads(result.stdout)
    assert facts.keys() >= RUN_KEYS | MAP_KEYS
    assert facts["gains"] == "table_2"
    assert facts["maps_read"] == facts["maps"] > 0  # the run before left them in the cache
    assert (tmp_path / "maps.json").read_bytes() == (out / "maps.json").read_bytes()
    assert not (tmp_path / "plan.json").exists()
    assert [directory for _, directory in drawn] == [tmp_path]
    assert NoDrawings.order == ["recording", "figures"]


def test_a_motion_is_not_carried_out_with_a_gain_set(finished, room, tmp_path):
    plan = finished[0] / "plan.json"
    refused = invoke("simulate", room, "--plan", plan, "--out", tmp_path, "--gains", "table_2")
    assert refused.exit_code == 2
    assert f"{plan}: its team passes from cell to cell" in " ".join(refused.stderr.split())


@pytest.mark.parametrize(("deployment", "warned"), [({}, False), ({"preset": "mobile_base"}, True)])
def test_a_plan_for_another_deployment_is_read_with_a_warning(finished, tmp_path, deployment, warned):
    path, shown = write_scenario(tmp_path / "room.scenario.yaml", deployment=deployment), StringIO()
    with redirect_stdout(shown), pytest.raises(typer.Exit), reporting() as reporter:
        simulate.read_plan(read_task(path), finished[0] / "plan.json", reporter)
    assert ("make these 19.5 ms old; `coop-drake plan`" in shown.getvalue()) == warned


def test_a_budget_that_ends_is_undecided(tmp_path, monkeypatch):
    sample_little(monkeypatch)
    text = (MODELS / "closed.scenario.yaml").read_text() + "\nplanner: {max_slices: 5}\n"
    path = tmp_path / "short.scenario.yaml"
    path.write_text(text)
    result = invoke("plan", path, "--out", tmp_path / "out", "--json")
    assert result.exit_code == 4, result.stderr
    assert json.loads(result.stdout)["answer"] == "undecided"


def test_a_violation_ends_in_exit_code_1_and_says_which(finished, room, tmp_path, monkeypatch, drawn):
    out, _ = finished
    log = SimulationLog.load(out / "log.npz")
    broken = replace(log, reached=False, violation="robot_0::base left the workspace at t = 1.5 s by 2 mm")
    monkeypatch.setattr(simulation, "simulate", lambda *_, **__: broken)
    result = invoke("simulate", room, "--plan", out / "plan.json", "--out", tmp_path, "--json")
    assert result.exit_code == 1
    facts = json.loads(result.stdout)
    assert (facts["violations"], facts["reached"]) == (1, False)
    assert facts["violation"] == facts["error"] == broken.violation
    assert broken.violation in result.stderr
    assert (tmp_path / "log.npz").exists()
    assert [log for *_, log, _ in drawn] == [broken]


def test_a_live_run_is_looked_at_and_says_where_without_waiting_for_anybody(
    finished, room, tmp_path, monkeypatch
):
    looking = []

    def simulated(*_, observer, **__):
        looking.append(observer)
        raise PlanError("far enough")

    monkeypatch.setattr(simulation, "simulate", simulated)
    plan = finished[0] / "plan.json"
    result = invoke("simulate", room, "--plan", plan, "--out", tmp_path / "live", "--live", "--json")
    assert isinstance(looking[0], LivePage)
    address = json.loads(result.stdout)["live_url"]
    assert address.startswith("http://localhost:")
    assert f"Live view: open {address}" in result.stderr


def test_a_live_run_may_wait_for_a_browser_as_long_as_it_takes(finished, room, tmp_path, monkeypatch):
    waited = []

    def simulated(*_, observer, **__):
        raise PlanError(f"far enough, after {len(waited)} waits")

    monkeypatch.setattr(simulation, "simulate", simulated)
    monkeypatch.setattr(LivePage, "wait_for_viewer", lambda _, seconds: waited.append(seconds))
    plan = finished[0] / "plan.json"
    result = invoke("simulate", room, "--plan", plan, "--out", tmp_path / "live", "--wait", "--json")
    assert waited == [inf]
    assert "after 1 waits" in result.stderr
    assert "live_url" in json.loads(result.stdout)


@pytest.mark.slow
def test_warming_up_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = invoke("doctor", "--warm")
    assert result.exit_code == 0, result.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_plan_of_another_scenario_is_bad_input(finished, room, tmp_path):
    out, _ = finished
    other = write_scenario(
        tmp_path / "other.scenario.yaml",
        start={"object": {"x": 2.6, "y": 2.0, "theta": 0.0}, "joints": ROOM["start"]["joints"]},
    )
    result = invoke("simulate", other, "--plan", out / "plan.json", "--json")
    assert result.exit_code == 2
    assert "start: [2.5, " in json.loads(result.stdout)["error"]
    goal = write_scenario(
        tmp_path / "goal.scenario.yaml", goal={"object": {**ROOM["goal"]["object"], "x": 2.0, "y": 2.0}}
    )
    result = invoke("simulate", goal, "--plan", out / "plan.json", "--json")
    assert result.exit_code == 2
    assert "goal_pose: [3.2, " in json.loads(result.stdout)["error"]


def test_a_file_where_the_results_should_go_is_refused_before_planning(room, tmp_path):
    (tmp_path / "taken").write_text("")
    result = invoke("plan", room, "--out", tmp_path / "taken", "--json")
    assert result.exit_code == 2
    assert (tmp_path / "taken").read_text() == ""
    below = invoke("show", room, "--out", tmp_path / "taken" / "show.png")
    assert below.exit_code == 2
    assert f"{tmp_path / 'taken'}: a file stands where a folder is needed; expected" in below.output.replace(
        "\n", ""
    )


def test_wrong_usage_is_bad_input_for_people_and_machines():
    command = [sys.executable, "-c", "from coop_drake.cli import main; main()", "plan", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "SCENARIO" in json.loads(done.stdout)["error"]
    assert "SCENARIO" in done.stderr
    assert "Traceback" not in done.stderr


def test_machines_get_no_infinities_and_no_numpy_at_any_depth(capsys):
    reporter = Reporter(machine=True, quiet=True)
    reporter.facts.update(
        a=inf, b=np.int64(2), c=np.bool_(True), rows=[{"all": (nan, np.float64(1.5))}, [-inf]]
    )
    reporter.close()
    said = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert said == {"a": None, "b": 2, "c": True, "rows": [{"all": [None, 1.5]}, [None]]}


def test_a_diagram_is_drawn_as_svg_and_a_stranger_s_controller_refused(room, tmp_path):
    (tmp_path / "plan.json").write_text("of an earlier run")
    result = invoke("diagram", room, "--robot", "1", "--out", tmp_path)
    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "plan.json").read_text() == "of an earlier run"
    drawing = (tmp_path / "diagram.svg").read_text()
    assert drawing.startswith("<?xml")
    assert "Controller of robot 1" in drawing
    refused = invoke("diagram", room, "--robot", "7", "--out", tmp_path / "none")
    assert refused.exit_code == 2
    assert "a number from 0 to 1" in refused.stderr
    assert not (tmp_path / "none").exists()
